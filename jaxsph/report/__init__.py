"""Reports as pages that open anywhere; `page` makes them, the others say what is in them."""
