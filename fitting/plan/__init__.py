"""Planning of the first campaign on a spring of a new alloy by expected information.

>>> from fitting.plan import plan_campaign
>>> plan = plan_campaign(geometry={"active_coils": 40.0})
>>> print(plan.report())
"""

from .plan import Plan, PlannedTest, plan_campaign

__all__ = ["Plan", "PlannedTest", "plan_campaign"]
