"""`roboyard drive --policy`: run a trained policy in its task."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from roboyard.untrusted.text import json_text, say

if TYPE_CHECKING:
    from roboyard.envs.play import Episode

EPISODES = 5
"""Episodes of a policy without a page."""


def run_policy(
    file: Path,
    *,
    steps: int | None,
    seed: int,
    record: Path | None,
    browser: bool,
    host: str,
    port: int,
    open_browser: bool,
    as_json: bool,
) -> None:
    """Run a policy and print the result of each episode."""
    from roboyard.envs.play import play
    from roboyard.envs.policy import load_policy

    policy = load_policy(file)
    if not as_json:
        say(f"{policy.task}" + "".join(f", {key} {value}" for key, value in policy.options.items()))
    episodes = play(
        policy,
        steps=steps,
        seed=seed,
        record=record,
        viewer=browser,
        host=host,
        port=port,
        open_browser=open_browser,
    )
    played: list[Episode] = []
    try:
        for episode in episodes:
            played.append(episode)
            goal = "" if episode.success is None else ", goal " + ("reached" if episode.success else "missed")
            if not as_json:
                say(
                    f"episode {episode.number}: {episode.steps} steps, reward {episode.reward:.1f}, "
                    f"end: {episode.end}{goal}"
                )
            if not browser and episode.number == EPISODES:
                break
    except KeyboardInterrupt:
        pass
    finally:
        episodes.close()
    written = [str(record)] if record is not None and record.is_file() else []
    if as_json:
        done = {"task": policy.task, "options": dict(policy.options)}
        print(json_text({**done, "episodes": [asdict(episode) for episode in played], "files": written}))
    elif written:
        say(f"wrote {record}")
