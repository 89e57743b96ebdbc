"""One figure a file; each takes NumPy arrays and the path to write."""

from .centre_line import Profile as Profile
from .centre_line import centre_line_profiles as centre_line_profiles
from .differences import field_differences as field_differences
from .discrepancy import discrepancy_history as discrepancy_history
from .expected_errors import expected_errors as expected_errors
from .mode_shapes import modes as modes
from .snapshots import field_snapshots as field_snapshots
from .spectrum import singular_values as singular_values
