"""Cases, their table, their figures and the reports, JSON and HTML."""

from .case import Case as Case
from .figures import Profile as Profile
from .figures import centre_line_profiles as centre_line_profiles
from .figures import discrepancy_history as discrepancy_history
from .figures import field_differences as field_differences
from .figures import field_snapshots as field_snapshots
from .figures import modes as modes
from .figures import singular_values as singular_values
from .html_report import Shown as Shown
from .html_report import write_html_report as write_html_report
from .json_report import write_report as write_report
from .table import format_table as format_table
from .verdict import best as best
from .verdict import verdict as verdict
