"""What tells one run from another: everything that changes it, as names and short texts."""

from .content import content as content
from .content import differences as differences
from .content import digest as digest
