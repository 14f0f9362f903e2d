# Spheres falling on a plate, written by YADE 2023.02a itself: yade -n -x spheres.py
# flake8: noqa: F821
from yade import export

O.materials.append(FrictMat(density=2500, young=1e6, poisson=0.3, frictionAngle=0.5))
O.bodies.append(utils.wall(0, axis=2, sense=1))
places = [
    (0.01 * i, 0.01 * j, 0.006 + 0.01 * k) for k in range(2) for j in range(2) for i in range(3)
]
for n, place in enumerate(places):
    O.bodies.append(utils.sphere(place, 0.004 + 0.0001 * n))
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FrictPhys()],
        [Law2_ScGeom_FrictPhys_CundallStrack()],
    ),
    NewtonIntegrator(gravity=(0, 0, -9.81), damping=0.2),
]
O.dt = 0.2 * PWaveTimeStep()
for steps in (0, 500):
    if steps:
        O.run(steps, True)
    export.text("plain_%d.txt" % steps)
    export.textExt("material_%d.txt" % steps, "x_y_z_r_matId", comment="spheres on a plate")
    export.textExt(
        "attributes_%d.txt" % steps,
        "x_y_z_r_attrs",
        comment="spheres on a plate\nvx vy vz mass id",
        attrs=["b.state.vel", "b.state.mass", "b.id"],
    )
    export.textExt("numbered_%d.txt" % steps, "id_x_y_z_r_matId")
