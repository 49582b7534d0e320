"""Time histories with memories of springs and effects: actuator, spring, tube, coupon."""
