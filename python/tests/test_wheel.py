"""The wheel is what it says."""

from __future__ import annotations

import importlib.metadata

import pytest

from swarmfit import _core


def test_a_wheel_for_later_pythons_is_of_the_stable_abi() -> None:
    try:
        tags = importlib.metadata.distribution("swarmfit").read_text("WHEEL")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("swarmfit was not installed from a wheel")
    assert tags is not None
    assert ("-abi3-" in tags) == _core.__file__.endswith(".abi3.so"), f"{_core.__file__} in a wheel of\n{tags}"
