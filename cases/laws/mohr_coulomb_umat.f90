! Mohr-Coulomb as an Abaqus UMAT. PROPS: Young modulus [Pa], Poisson ratio, friction angle, dilation
! angle [deg], cohesion [Pa]. No state variables. DDSDDE is the consistent tangent.
subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, &
                time, dtime, temp, dtemp, predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, &
                nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, &
                kstep, kinc)
  use mohr_coulomb, only: dp, mc_constants, mc_from_props, mc_update
  implicit none
  character(len=80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep, kinc
  real(dp) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl
  real(dp) :: ddsddt(ntens), drplde(ntens), drpldt, stran(ntens), dstran(ntens), time(2), dtime
  real(dp) :: temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3), pnewdt
  real(dp) :: celent, dfgrd0(3, 3), dfgrd1(3, 3)
  real(dp) :: strain(6), dissipated
  strain = dstran(1:6)
  strain(4:6) = 0.5_dp*strain(4:6)  ! tensor components of an engineering shear strain
  call mc_update(mc_from_props(props(1:5)), stress(1:6), strain, sse, dissipated, ddsdde(1:6, 1:6))
  spd = spd + dissipated
end subroutine
