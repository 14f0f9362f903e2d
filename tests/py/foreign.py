"""Files of other DEM programs, made by the programs themselves: some hundred grains, a second."""

from pathlib import Path

from cases.programs import call
from dem_reference import lammps

# Grains that overlap a little and are pushed against each other; without gravity and walls, so that
# a grain's force is the sum of its contacts.
LAMMPS = """
atom_style sphere
units si
boundary p p s
newton off
comm_modify vel yes
{box}
lattice sc 0.00098
create_atoms 1 box
set type 1 diameter 0.001
set type 1 density 2500
velocity all create 1.0 12 dist uniform
variable vx atom 0.2*(random(0,1,11)-0.5)
variable vz atom 0.2*(random(0,1,13)-0.5)
velocity all set v_vx NULL v_vz
pair_style gran/hooke/history 200.0 NULL 1.5 NULL 0.5 1
pair_coeff * *
neighbor 0.0003 bin
neigh_modify every 50 delay 0 check no
timestep 1e-6
fix 1 all nve/sphere
compute q all property/local patom1 patom2
compute p all pair/local dist fx fy fz p1 p2 p3
dump plain all custom 100 plain.dump id type x y z vx vy vz fx fy fz radius
dump image all custom 100 image.dump id type x y z ix iy iz vx vy vz diameter
dump scaled all custom 100 scaled.dump id type xs ys zs radius mass
dump unwrapped all custom 100 unwrapped.dump radius id xu yu zu ix iy iz element
dump both all custom 100 both.dump id xsu ysu zsu ix iy iz
dump atoms all atom 100 atoms.dump
dump packed all custom 100 packed.dump.gz id x y z
dump per_step all custom 100 step.*.dump id x y z
dump told all custom 100 told.dump id x y z
dump binary all custom 100 plain.bin id x y z
dump local all local 100 local.dump c_q[1] c_q[2] c_p[1] c_p[2] c_p[3] c_p[4] c_p[5] c_p[6] c_p[7]
dump normal all local 100 normal.dump c_q[1] c_q[2] c_p[2] c_p[3] c_p[4]
dump_modify plain sort id format float %.16g
dump_modify scaled format float %.16g
dump_modify both format float %.16g
dump_modify unwrapped format float %.16g
dump_modify local format float %.16g
dump_modify told units yes time yes
run 300
"""
BOX = "region box block 0 0.0049 0 0.0049 0 0.005\ncreate_box 1 box"
TILTED = (
    "region box prism 0 0.0049 0 0.0049 0 0.005 0.001 -0.0007 0.0012 units box\ncreate_box 1 box"
)

LIGGGHTS = """
atom_style granular
atom_modify map array
boundary p p f
newton off
communicate single vel yes
units si
region box block 0 0.0055 0 0.0055 -0.001 0.02 units box
create_box 1 box
neighbor 0.0005 bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 5.e6
fix m2 all property/global poissonsRatio peratomtype 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.99
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-6
fix floor all mesh/surface file floor.stl type 1
fix zw all wall/gran model hertz tangential history mesh n_meshes 1 meshes floor
lattice sc 0.00099
region fill block 0 0.0054 0 0.0054 0.0004 0.004 units box
create_atoms 1 region fill
set group all density 2500
set group all diameter 0.001
velocity all set 0.1 0.0 -0.25
fix integr all nve/sphere
compute pg all pair/gran/local {words}
compute wg all wall/gran/local id pos force
dump d all custom 1500 l_*.dump id type type x y z ix iy iz vx vy vz fx fy fz omegax omegay &
 omegaz radius mass
dump vt all custom/vtk 1500 text_*.vtk {columns}
dump vb all custom/vtk 1500 bytes_*.vtk {columns}
dump_modify vb binary yes
dump vp all custom/vtk 1500 text_*.vtp {columns}
dump vpb all custom/vtk 1500 bytes_*.vtp {columns}
dump_modify vpb binary yes
dump vu all custom/vtk 1500 text_*.vtu {columns}
dump vub all custom/vtk 1500 bytes_*.vtu {columns}
dump_modify vub binary yes
dump pairs all local 1500 pairs_*.local {pairs}
dump walls all local 1500 walls_*.local {walls}
run 3000
"""
COLUMNS = "id type x y z vx vy vz fx fy fz omegax omegay omegaz radius mass"
FLOOR = """solid floor
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 0.0055 0 0
vertex 0.0055 0.0055 0
endloop
endfacet
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 0.0055 0.0055 0
vertex 0 0.0055 0
endloop
endfacet
endsolid floor
"""


def run_lammps(folder: Path, box: str = BOX) -> Path:
    """The folder of what LAMMPS dumps of its grains, steps 0 to 300."""
    lammps.run(LAMMPS.format(box=box), folder)
    return folder


def run_liggghts(folder: Path, words: str = "id pos force", columns: int = 12) -> Path:
    """The folder of what LIGGGHTS dumps of its grains, steps 0, 1500 and 3000, their contacts asked
    for by `words`.
    """
    (folder / "floor.stl").write_text(FLOOR)
    text = LIGGGHTS.format(
        words=words,
        columns=COLUMNS,
        pairs=" ".join(f"c_pg[{i}]" for i in range(1, columns + 1)),
        walls=" ".join(f"c_wg[{i}]" for i in range(1, 13)),
    )
    (folder / "in.liggghts").write_text(text)
    done = call(["liggghts", "-in", "in.liggghts", "-log", "log"], cwd=folder)
    assert done.returncode == 0, done.stdout[-500:]
    return folder
