"""Memories of springs and effects carried along rows: actuator, spring, tube, coupon."""
