"""Values as strict JSON can hold them."""

from jaxsph.record import plain as plain
