"""Which setting to run for a wanted accuracy, from measurements that ship with the package."""

from .advise import TABLE as TABLE
from .advise import Advice as Advice
from .advise import Row as Row
from .advise import advise as advise
from .advise import percent as percent
from .advise import read_table as read_table
from .advise import seconds as seconds
