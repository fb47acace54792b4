"""Run the scenario `turn` and record it, as a script of one's own would."""

from pathlib import Path

from motm_wbc import load_robot, load_scenario, run

FAILURE_DELAY = 3.0  # [s] grasps fail for this long after the first attempt
RECORDING = Path("out/turn.rrd")


def main() -> None:
    RECORDING.parent.mkdir(exist_ok=True)
    result = run(
        load_scenario("turn"),
        robot=load_robot("frankie"),
        method="proposed",
        failure_delay=FAILURE_DELAY,
        record=RECORDING,
    )
    summary = result.summary
    print(f"{summary.scenario}: success={summary.success}, {summary.task_time_s} s")
    print(f"{summary.grasp_attempts} grasp attempts, recorded in {RECORDING}")


if __name__ == "__main__":
    main()
