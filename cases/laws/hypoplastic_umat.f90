! Hypoplastic sand as an Abaqus UMAT. PROPS: hypo_from_props of hypoplastic.f90. STATEV: void ratio,
! intergranular strain 11 22 33 12 13 23 (tensor components). DDSDDE is the tangent of the rate
! equation at the end of the step, in the step's direction; SSE and SPD are left as they come: the
! law has no energy. PNEWDT is 1/4 where the step is not integrated.
subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, &
                time, dtime, temp, dtemp, predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, &
                nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, &
                kstep, kinc)
  use hypoplastic, only: dp, unknowns, hypo_constants, hypo_from_props, hypo_integrate, hypo_tangent
  implicit none
  character(len=80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep, kinc
  real(dp) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl
  real(dp) :: ddsddt(ntens), drplde(ntens), drpldt, stran(ntens), dstran(ntens), time(2), dtime
  real(dp) :: temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3), pnewdt
  real(dp) :: celent, dfgrd0(3, 3), dfgrd1(3, 3)
  real(dp) :: y(unknowns), strain(6), h(3, 3)
  type(hypo_constants) :: c
  logical :: failed
  c = hypo_from_props(props)
  strain = dstran(1:6)
  strain(4:6) = 0.5_dp*strain(4:6)  ! tensor components of an engineering shear strain
  y = 0.0_dp
  y(1:6) = stress(1:6)
  y(7) = statev(1)
  if (c%mr > 0.0_dp) then  ! a tensor of the material turns with it
    h = reshape([statev(2), statev(5), statev(6), statev(5), statev(3), statev(7), statev(6), &
                 statev(7), statev(4)], [3, 3])
    h = matmul(drot, matmul(h, transpose(drot)))
    y(8:13) = [h(1, 1), h(2, 2), h(3, 3), h(1, 2), h(1, 3), h(2, 3)]
  end if
  call hypo_integrate(c, y, strain, failed)
  if (failed) then
    pnewdt = 0.25_dp
    return
  end if
  stress(1:6) = y(1:6)
  statev(1) = y(7)
  if (c%mr > 0.0_dp) statev(2:7) = y(8:13)
  ddsdde(1:6, 1:6) = hypo_tangent(c, y, strain)
end subroutine
