import pytest

from validation.reproduction import Bench, judge, statements


@pytest.fixture(scope="session")
def bench():
    return Bench()


@pytest.fixture(scope="session")
def judged(bench):
    """What was found on every statement, by its number."""
    return {statement.number: judge(statement, bench) for statement in statements()}
