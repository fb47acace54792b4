"""The task: steps, the arm's reach, grasp attempts, and who leads the base."""
