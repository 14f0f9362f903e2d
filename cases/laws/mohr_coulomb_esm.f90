! Mohr-Coulomb as an external soil model of Anura3D; the same PROPS. Components: xx yy zz xy yz zx.
subroutine esm(npt, noel, idset, stress, eunloading, plasticmultiplier, dstran, nstatev, statev, &
               naddvar, additionalvar, cmname, nprops, props, numberofphases, ntens)
  use mohr_coulomb, only: dp, mc_constants, mc_from_props, mc_update
  implicit none
  character(len=80) :: cmname
  integer :: npt, noel, idset, nstatev, naddvar, nprops, numberofphases, ntens
  real(dp) :: stress(ntens), eunloading, plasticmultiplier, dstran(ntens), statev(nstatev)
  real(dp) :: additionalvar(naddvar), props(nprops)
  integer, parameter :: order(6) = [1, 2, 3, 4, 6, 5]  ! to 11 22 33 12 13 23, and back
  real(dp) :: ordered(6), strain(6), stored, dissipated
  type(mc_constants) :: c
  c = mc_from_props(props(1:5))
  ordered = stress(order)
  strain = dstran(order)
  strain(4:6) = 0.5_dp*strain(4:6)  ! tensor components of an engineering shear strain
  call mc_update(c, ordered, strain, stored, dissipated)
  stress(order) = ordered
  eunloading = c%lame + 2.0_dp*c%shear
end subroutine
