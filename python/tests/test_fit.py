from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import swarmfit


def test_finds_the_planes(corner: np.ndarray) -> None:
    result = swarmfit.fit(corner, "plane", threshold=0.01)
    assert len(result.models) == 3
    truth = np.array([[0, 0, 1], [1, 0, 0], [0, 0.98058068, 0.19611614]])
    for model in result.models:
        assert model.type == "plane"
        assert np.abs(truth @ model.normal).max() > 0.9999
        assert model.covariance.shape == (4, 4)
        assert model.rms < 0.004
        distance = np.abs(corner @ model.normal + model.offset)
        assert (distance < 0.01).sum() >= model.inliers
    assert result.labels.dtype == np.uint16
    assert result.labels.shape == (len(corner),)
    assert [int((result.labels == k + 1).sum()) for k in range(3)] == [m.inliers for m in result.models]


def test_several_kinds_compete(corner: np.ndarray) -> None:
    result = swarmfit.fit(corner, "sphere,plane,cylinder", threshold=0.01)
    assert [model.type for model in result.models] == ["plane"] * 3
    with pytest.raises(ValueError, match="line2d"):
        swarmfit.fit(corner, "plane,line2d")


def test_stats_explain_the_result(corner: np.ndarray) -> None:
    result = swarmfit.fit(corner, threshold=0.01, backend="cpu", seed=3)
    stats = result.stats
    assert (stats.backend, stats.seed, stats.threshold, stats.finite_points) == ("cpu", 3, 0.01, len(corner))
    assert stats.iterations > 0
    assert stats.total_ms > 0
    assert stats.stop_reason
    assert not stats.copied
    assert "models explain" in str(result)
    assert set(dataclasses.asdict(stats)) >= {"device", "backend_reason", "evaluations", "points_touched"}


def test_same_seed_same_answer_on_any_threads(corner: np.ndarray) -> None:
    one = swarmfit.fit(corner, threshold=0.01, threads=1, seed=5)
    two = swarmfit.fit(corner, threshold=0.01, threads=2, seed=5)
    assert all((a.parameters == b.parameters).all() for a, b in zip(one.models, two.models))
    assert (one.labels == two.labels).all()


def test_result_outlives_what_it_came_from(corner: np.ndarray) -> None:
    labels = swarmfit.fit(corner, threshold=0.01).labels
    normal = swarmfit.fit(corner, threshold=0.01).models[0].normal
    assert (labels > 0).sum() > 8000
    assert abs(np.linalg.norm(normal) - 1) < 1e-9
    with pytest.raises(ValueError, match="read-only"):
        labels[0] = 1


def test_callback_hears_of_each_model_and_may_stop(corner: np.ndarray) -> None:
    heard: list[swarmfit.Model] = []
    result = swarmfit.fit(corner, threshold=0.01, on_model=heard.append)
    assert len(heard) >= len(result.models) == 3
    heard.clear()

    def first(model: swarmfit.Model) -> bool:
        heard.append(model)
        return False

    result = swarmfit.fit(corner, threshold=0.01, on_model=first)
    assert len(heard) == len(result.models) == 1


def test_what_a_callback_raises_ends_the_fit(corner: np.ndarray) -> None:
    def broken(_: swarmfit.Model) -> None:
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        swarmfit.fit(corner, threshold=0.01, on_model=broken)


def test_iterates_over_models_as_they_are_found(corner: np.ndarray) -> None:
    stream = swarmfit.find_models(corner, threshold=0.01)
    found = list(stream)
    assert len(found) >= 3
    assert all(a.found_at_ms <= b.found_at_ms for a, b in zip(found, found[1:]))
    result = stream.result()
    assert len(result.models) == 3
    assert (result.labels == swarmfit.fit(corner, threshold=0.01).labels).all()


def test_an_iteration_can_be_left(corner: np.ndarray) -> None:
    for _ in swarmfit.find_models(corner, threshold=0.01):
        break
    with swarmfit.find_models(corner, threshold=0.01) as stream:
        assert next(stream).inliers > 0
    assert len(stream.result().models) >= 1


def test_a_fitter_is_reused_and_warm_started(corner: np.ndarray) -> None:
    fitter = swarmfit.Fitter("plane", 0.01)
    first = fitter.fit(corner)
    again = fitter.fit(corner + np.float32(0.001), warm_start=first.models)
    assert len(first.models) == len(again.models) == 3
    by_hand = swarmfit.Model("plane", [0, 0, 1, 0.5])
    assert len(fitter.fit(corner, warm_start=[by_hand]).models) == 3
    assert fitter.backend[0] in ("cpu", "vulkan")
    stream = fitter.find_models(corner)
    with pytest.raises(RuntimeError, match="at work; make one a thread"):
        fitter.fit(corner)
    stream.stop()
    stream.result()


def test_other_kinds() -> None:
    rng = np.random.default_rng(1)
    direction = rng.normal(size=(2000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    ball = np.concatenate([[0.1, 0.2, 1.0] + 0.3 * direction, rng.uniform(-1, 1, (500, 3)) + [0, 0, 1]])
    sphere = swarmfit.fit(ball, "sphere", threshold=0.005, max_models=1).models[0]
    assert abs(sphere.radius - 0.3) < 1e-3
    assert np.allclose(sphere.centre, [0.1, 0.2, 1.0], atol=2e-3)
    with pytest.raises(AttributeError, match="a sphere has no normal"):
        _ = sphere.normal

    x = rng.uniform(0, 1, 300)
    line = np.stack([x, 0.5 * x + 0.1], axis=1) + rng.normal(0, 1e-3, (300, 2))
    found = swarmfit.fit(np.concatenate([line, rng.uniform(0, 1, (200, 2))]), "line2d", threshold=0.01).models[0]
    assert found.normal.shape == (2,)
    assert abs(found.normal @ np.array([1, 0.5])) < 0.02

    h = np.array([[1.1, 0.02, 10], [0.01, 0.95, -5], [1e-5, 2e-5, 1]])
    first = np.c_[rng.uniform(0, 640, (300, 2)), np.ones(300)]
    second = first @ h.T
    pairs = np.c_[first[:, :2], second[:, :2] / second[:, 2:]]
    matrix = swarmfit.fit(pairs, "homography", max_models=1).models[0].matrix
    assert matrix.shape == (3, 3)
    assert np.allclose(matrix / matrix[2, 2], h, atol=1e-3)


def test_options_by_name(corner: np.ndarray) -> None:
    up = swarmfit.fit(corner, threshold=0.01, direction=([0, 0, 1], 0.1))
    assert len(up.models) == 1
    assert abs(up.models[0].normal[2]) > 0.999
    assert len(swarmfit.fit(corner, threshold=0.01, max_models=2).models) == 2
    assert swarmfit.fit(corner, threshold="auto").stats.threshold > 0
    assert swarmfit.fit(corner, threshold=np.float32(0.01), particles=np.int64(64), preset="fast", min_inliers=None).models


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"threshold": -1}, swarmfit.InvalidOption, "threshold is -1, must be finite and > 0"),
        ({"threshold": "much"}, swarmfit.InvalidOption, "threshold is 'much', must be a number > 0 or 'auto'"),
        ({"model": "plain"}, ValueError, "plain"),
        ({"particles": 1}, ValueError, r"particles is 1, must be in \[2, 1000000\]"),
        ({"min_inliers": -5}, ValueError, "min_inliers is -5, must be a whole number >= 0"),
        ({"preset": "slow"}, ValueError, "preset is 'slow', must be 'fast' or 'paper'"),
        ({"backend": "abacus"}, swarmfit.BackendUnavailable, "abacus"),
        ({"backend": "abacus"}, RuntimeError, "abacus"),
        ({"particles": 2.5}, TypeError, "particles is 2.5, must be a whole number"),
        ({"direction": ([0, 0, 0], 0.1)}, ValueError, "must be finite and not zero"),
        ({"tau": 1}, TypeError, "unknown option 'tau'"),
    ],
)
def test_errors_name_field_value_and_bound(corner: np.ndarray, options: dict[str, Any], kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        swarmfit.fit(corner, **options)


def test_errors_of_data() -> None:
    with pytest.raises(swarmfit.BadInput, match="points is 2, must be >= 3 to fit a plane"):
        swarmfit.fit(np.zeros((2, 3)))
    with pytest.raises(ValueError, match="points have 2 columns, must have 3 to fit a plane"):
        swarmfit.fit(np.zeros((10, 2)))
    with pytest.raises(swarmfit.BadInput, match="finite points is 0 of 10"):
        swarmfit.fit(np.full((10, 3), np.nan))
    with pytest.raises(swarmfit.BadInput, match="must have 4 for a plane"):
        swarmfit.Model("plane", [1, 2])
    with pytest.raises(swarmfit.BadInput, match="points is 0"):
        swarmfit.fit(np.zeros((0, 3), np.float32))
    with pytest.raises(swarmfit.BadInput, match="no-such-file.pcd"):
        swarmfit.read_cloud("no-such-file.pcd")
    stream = swarmfit.find_models(np.zeros((2, 3)))
    with pytest.raises(swarmfit.BadInput, match="must be >= 3"):
        next(stream)
