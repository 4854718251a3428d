"""`host-tool diagnose` of this project, on the paper's model with nothing known of the mirror.

Its verdict is taken as it is, with the threshold of its own null ensemble; probabilities are calibrated on `train` as every other
method's. The score is the best effect's over its threshold. Errors are those of base and effect fitted to all rows: what the tool
tells of rows held out has the model's discrepancy in it, which other methods have not.

The environment variable HOST_TOOL says where the tool is.
"""

import json
import os
import subprocess

from session import stages
from verdict import Finding, run


def find(session, data, work):
    words = [os.environ["HOST_TOOL"], "diagnose", "paper", str(data / "sessions" / session.id), "--json"]
    output = subprocess.run(words, env={**os.environ, "XDG_CACHE_HOME": str(work)}, capture_output=True, text=True, check=True)
    said = json.loads(output.stdout)
    best = said["ranking"][0]
    named = said["effects"]
    stage = stages(data)[named[0] if named else best["effect"]]
    chosen = next((ranked for ranked in said["ranking"] if named and ranked["effect"] == named[0]), best)
    return Finding(
        score=max(best["score"], 0.0) / best["threshold"],
        effects=named,
        stage=stage,
        confidence=chosen["probability"],
        rms_before_um=chosen["error_rms"]["before"],
        rms_after_um=chosen["error_rms"]["after"],
        verdict={"none": "none", "unknown": "unknown"}.get(said["verdict"], "named"),
    )


if __name__ == "__main__":
    run(find)
