"""Files of policies: what is written is read back, and files from strangers are refused."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard.envs.policy import Policy, load_policy
from roboyard.errors import ConfigError


def small() -> Policy:
    random = np.random.default_rng(0)
    return Policy(
        task="roboyard/Reach-v0",
        options={"robot": "arm7"},
        mean=random.normal(size=3),
        deviation=random.uniform(0.5, 2.0, 3),
        layers=(
            (random.normal(size=(4, 3)), random.normal(size=4)),
            (random.normal(size=(2, 4)), random.normal(size=2)),
        ),
    )


def test_a_policy_is_the_network_that_its_numbers_describe(tmp_path: Path) -> None:
    policy = small()
    policy.save(tmp_path / "p.json")
    read = load_policy(tmp_path / "p.json")
    assert read.task == policy.task and read.options == policy.options
    x = np.array([0.3, -0.2, 0.9])
    assert policy.mean is not None and policy.deviation is not None
    hidden = np.tanh(policy.layers[0][0] @ ((x - policy.mean) / policy.deviation) + policy.layers[0][1])
    expected = np.clip(policy.layers[1][0] @ hidden + policy.layers[1][1], -1, 1)
    np.testing.assert_array_equal(read(x[None])[0], read(np.stack([x, x]))[1])
    np.testing.assert_allclose(read(x), expected, atol=1e-15)


def test_other_files_are_not_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "notes.json"
    file.write_text("{}")
    with pytest.raises(ConfigError, match="not a policy"):
        small().save(file)
    assert file.read_text() == "{}"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "x"}, "format"),
        ({"layers": []}, "layers"),
        ({"layers": [{"weight": [[1.0]], "bias": [1.0, 2.0]}]}, "do not fit"),
        ({"layers": [{"weight": "a", "bias": [1.0]}]}, "not a policy"),
        ({"layers": [{"weight": [[float("nan")] * 3], "bias": [1.0]}]}, "finite"),
        ({"mean": [1.0]}, "mean"),
        ({"activation": "exec"}, "activation"),
        ({"options": 3}, "options"),
        ({"task": None}, "task"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    small().save(tmp_path / "p.json")
    content = json.loads((tmp_path / "p.json").read_text())
    (tmp_path / "p.json").write_text(json.dumps({**content, **change}))
    with pytest.raises(ConfigError, match=message):
        load_policy(tmp_path / "p.json")


def test_files_from_strangers_are_refused(tmp_path: Path) -> None:
    (tmp_path / "deep.json").write_text("[" * 100_000)
    (tmp_path / "text.json").write_bytes(b"\x80\x04policy")
    os.mkfifo(tmp_path / "pipe.json")
    for name in ("deep.json", "text.json", "pipe.json", "none.json"):
        with pytest.raises(ConfigError, match=name):
            load_policy(tmp_path / name)
