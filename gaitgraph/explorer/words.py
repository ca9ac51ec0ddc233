"""Words about the choices of a plan that the page and the command line share; help loads no more than these."""

CHOICES_IN_WORDS = {
    "objective": "The shortest loop, or the one farthest from singular.",
    "method": "Straight lines in any direction (exact), or along the edges of the paper's graph (grid).",
    "require": "Rules that the gait must keep: physics too (flyable), or the paper's alone (valid).",
    "law": "Timing law: position along the loop over time.",
}
"""What each field of a request chooses between."""
