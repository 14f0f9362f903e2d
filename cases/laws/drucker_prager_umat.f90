! Circular cone q = M p as an Abaqus UMAT: linear elasticity, isochoric flow, no stress in tension.
! PROPS: bulk modulus [Pa], shear modulus [Pa], M. No state variables. DDSDDE is the consistent
! tangent.
subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran, dstran, &
                time, dtime, temp, dtemp, predef, dpred, cmname, ndi, nshr, ntens, nstatv, props, &
                nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, &
                kstep, kinc)
  implicit none
  integer, parameter :: dp = kind(1.0d0)
  character(len=80) :: cmname
  integer :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, kstep, kinc
  real(dp) :: stress(ntens), statev(nstatv), ddsdde(ntens, ntens), sse, spd, scd, rpl
  real(dp) :: ddsddt(ntens), drplde(ntens), drpldt, stran(ntens), dstran(ntens), time(2), dtime
  real(dp) :: temp, dtemp, predef(1), dpred(1), props(nprops), coords(3), drot(3, 3), pnewdt
  real(dp) :: celent, dfgrd0(3, 3), dfgrd1(3, 3)
  real(dp) :: bulk, shear, cone, p, old(6), s(6), size, lost, before, after
  real(dp), parameter :: one(6) = [1.0_dp, 1.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp]
  integer :: i
  bulk = props(1)
  shear = props(2)
  cone = sqrt(2.0_dp/3.0_dp)*props(3)  ! |s|/p on the cone
  old = stress(1:6) - sum(stress(1:3))/3.0_dp*one
  p = -sum(stress(1:3))/3.0_dp - bulk*sum(dstran(1:3))
  s = old + 2.0_dp*shear*(dstran(1:6) - sum(dstran(1:3))/3.0_dp*one)
  s(4:6) = s(4:6) - shear*dstran(4:6)  ! engineering shear strain
  size = sqrt(product_of(s, s))
  lost = 0.0_dp
  if (size > cone*max(p, 0.0_dp)) lost = 1.0_dp - cone*max(p, 0.0_dp)/size
  ! d(stress) = -1 dp + (1 - lost) 2 G dev, and on the cone n (cone dp - (1 - lost) 2 G n:dev)
  ddsdde(1:6, 1:6) = bulk*spread(one, 2, 6)*spread(one, 1, 6)
  do i = 1, 6
    ddsdde(1:6, i) = ddsdde(1:6, i) - (1.0_dp - lost)*2.0_dp/3.0_dp*shear*one(i)*one
    ddsdde(i, i) = ddsdde(i, i) + (1.0_dp - lost)*shear*(1.0_dp + one(i))
    if (lost > 0.0_dp) ddsdde(1:6, i) = ddsdde(1:6, i) &
                                        - s/size*(cone*bulk*one(i) + (1.0_dp - lost)*2.0_dp*shear*s(i)/size)
  end do
  if (p <= 0.0_dp) ddsdde(1:6, 1:6) = 0.0_dp
  before = merge(product_of(old, s), 0.0_dp, sum(stress(1:3)) < 0.0_dp)
  after = merge((1.0_dp - lost)*size**2, 0.0_dp, p > 0.0_dp)
  if (before > 0.0_dp) after = 0.5_dp*(before + after)
  spd = spd + lost*after/(2.0_dp*shear)
  p = max(p, 0.0_dp)
  s = (1.0_dp - lost)*s
  stress(1:6) = s - p*one
  sse = p**2/(2.0_dp*bulk) + product_of(s, s)/(4.0_dp*shear)

contains

  pure real(dp) function product_of(a, b)
    real(dp), intent(in) :: a(6), b(6)
    product_of = dot_product(a(1:3), b(1:3)) + 2.0_dp*dot_product(a(4:6), b(4:6))
  end function
end subroutine
