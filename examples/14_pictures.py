"""Show a grasp: a picture, a film, a page for any browser, and a scene for other programs.

With the name or the file of a hand behind the folder, e.g. `shadow_hand/right_hand`, it shows that hand as it is drawn.
"""

import sys
from pathlib import Path

import clench
from clench.apps.figures.film import draw_film, draw_still

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
mug = clench.GraspObject.load("mug")
if len(sys.argv) > 2:
    plan = clench.plan_grasps(clench.Hand.load(sys.argv[2]), mug, 8, seed=1, effort=16, path=False)
    command = next((grasp.command for grasp in plan if grasp.kind == "precision"), plan[0].command)
    hand, size = clench.Hand.load(sys.argv[2], collision_source="visual"), (600, 440)  # touches what is drawn
else:
    hand, size = clench.Hand.load("robonaut2"), (240, 180)
    command = clench.GraspCommand(clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5]), preshape="open")
solution = clench.solve(hand, mug, command)

print(draw_still(hand, mug, solution, folder / "still.png", (1100, 720)))
print(draw_film(hand, mug, solution, folder / "closing.webp", size=size))
print(clench.write_page(folder / "grasp.html", hand, mug, solution))
print(clench.formats.export_scene(folder / "grasp.glb", solution, hand, mug))
# In a notebook, `solution` alone shows a card. The next line shows the page there, or opens it in the browser:
# solution.show()
