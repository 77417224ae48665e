"""Any planar flexible machine of a file."""
