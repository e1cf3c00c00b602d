"""Bodies, joints and controllers around them."""
