! Hypoplastic sand: P.-A. von Wolffersdorff, Mech. Cohesive-frict. Mater. 1 (1996) 251-271, with the
! intergranular strain of A. Niemunis and I. Herle, Mech. Cohesive-frict. Mater. 2 (1997) 279-299.
! Stress T and stretching D are positive in tension; |A| = sqrt(A:A):
!     T' = L:D + N |D|,   L:D = f [F^2 D + a^2 R (R:D)],   N = f f_d a F (R + R*),
!     R = T/tr T,  R* its deviator,  f = f_s/(R:R).
! Below a pressure p_min the law sees the pressure that lacks: T - (p_min - p) I. So it is stiff at
! zero stress, from which it could not rise otherwise; the price is an apparent cohesion of at most
! p_min tan(phi_c). A mean tension at the end of a step leaves no stress.
! DEVIATION: a void ratio outside of e_d to e_i counts as the nearer of them: grains that a flow has
! loosened beyond what the law knows stay the loosest that it knows.
module hypoplastic
  implicit none
  private
  public :: hypo_constants, hypo_from_props, hypo_integrate, hypo_tangent

  integer, parameter, public :: dp = kind(1.0d0)
  integer, parameter, public :: unknowns = 13  ! stress (6), void ratio, intergranular strain (6)

  type :: hypo_constants
    real(dp) :: hs, n, ed0, ec0, ei0, alpha, beta
    real(dp) :: a, factor          ! a; (h_s/n) [3 + a^2 - sqrt(3) a ((ei0-ed0)/(ec0-ed0))^alpha]^-1
    real(dp) :: mr, mt, radius, betar, chi
    real(dp) :: lowest, tolerance  ! p_min [Pa]; error of a step, of stress over stress
  end type

  ! What stress, void ratio and intergranular strain make of the law's tensors: six components 11 22
  ! 33 12 13 23 of tensors; the linear part is linear*D + outer (ratio:D).
  type :: stiffness
    real(dp) :: linear, outer(6), ratio(6), n(6)
    real(dp) :: rho, along(6)  ! |h|/R, at most 1, and h/|h|
  end type

contains

  ! props: phi_c [deg], h_s [Pa], n, e_d0, e_c0, e_i0, alpha, beta, and, where there are more of them,
  ! m_R, m_T, R, beta_r, chi of intergranular strain (m_R = 0: none), p_min [Pa] (1), tolerance (1e-5)
  pure function hypo_from_props(props) result(c)
    real(dp), intent(in) :: props(:)
    type(hypo_constants) :: c
    real(dp) :: given(15), sine
    given = 0.0_dp
    given(14:15) = [1.0_dp, 1.0e-5_dp]
    given(1:min(15, size(props))) = props(1:min(15, size(props)))
    sine = sin(given(1)*acos(-1.0_dp)/180.0_dp)
    c%hs = given(2)
    c%n = given(3)
    c%ed0 = given(4)
    c%ec0 = given(5)
    c%ei0 = given(6)
    c%alpha = given(7)
    c%beta = given(8)
    c%a = sqrt(3.0_dp)*(3.0_dp - sine)/(2.0_dp*sqrt(2.0_dp)*sine)
    c%factor = c%hs/c%n/(3.0_dp + c%a**2 - sqrt(3.0_dp)*c%a &
                         *((c%ei0 - c%ed0)/(c%ec0 - c%ed0))**c%alpha)
    c%mr = given(9)
    c%mt = given(10)
    c%radius = given(11)
    c%betar = given(12)
    c%chi = given(13)
    c%lowest = given(14)
    c%tolerance = given(15)
  end function

  ! Steps of the length that keeps the error below the tolerance: the third-order formula of
  ! Runge and Kutta, whose difference from the midpoint rule is the error [W. Fellin and
  ! A. Ostermann, Int. J. Numer. Anal. Meth. Geomech. 26 (2002) 1213-1233].
  ! y: stress [Pa], void ratio, intergranular strain; strain: increment in tensor components;
  ! failed where 10 000 steps do not reach the end.
  pure subroutine hypo_integrate(c, y, strain, failed)
    type(hypo_constants), intent(in) :: c
    real(dp), intent(inout) :: y(unknowns)
    real(dp), intent(in) :: strain(6)
    logical, intent(out) :: failed
    real(dp) :: k1(unknowns), k2(unknowns), k3(unknowns), coarse(unknowns), fine(unknowns)
    real(dp) :: done, h, error
    integer :: tried
    failed = .false.
    if (maxval(abs(strain)) <= 0.0_dp) return
    done = 0.0_dp
    h = 1.0_dp
    do tried = 1, 10000
      k1 = rate(c, y, strain)
      do
        k2 = rate(c, y + 0.5_dp*h*k1, strain)
        k3 = rate(c, y + h*(2.0_dp*k2 - k1), strain)
        coarse = y + h*k2
        fine = y + h/6.0_dp*(k1 + 4.0_dp*k2 + k3)
        error = error_of(c, coarse, fine)
        if (error <= 1.0_dp) exit
        if (.not. h > 1.0e-12_dp) exit
        h = h*merge(max(0.2_dp, 0.9_dp*error**(-1.0_dp/3.0_dp)), 0.2_dp, error < huge(1.0_dp))
      end do
      if (.not. error <= 1.0_dp) exit
      y = fine
      done = done + h
      if (done >= 1.0_dp - 1.0e-12_dp) then
        if (sum(y(1:3)) > 0.0_dp) y(1:6) = 0.0_dp
        return
      end if
      h = min(1.0_dp - done, h*min(5.0_dp, 0.9_dp*max(error, 1.0e-6_dp)**(-1.0_dp/3.0_dp)))
    end do
    failed = .true.
  end subroutine

  ! Error over what is allowed: of stress against stress, of intergranular strain against R.
  pure real(dp) function error_of(c, coarse, fine)
    type(hypo_constants), intent(in) :: c
    real(dp), intent(in) :: coarse(unknowns), fine(unknowns)
    error_of = magnitude(fine(1:6) - coarse(1:6))/max(magnitude(fine(1:6)), c%lowest)
    if (c%mr > 0.0_dp) error_of = max(error_of, magnitude(fine(8:13) - coarse(8:13))/c%radius)
    error_of = error_of/c%tolerance
  end function

  ! Rates of stress, void ratio and intergranular strain over a step's strain.
  pure function rate(c, y, strain) result(dy)
    type(hypo_constants), intent(in) :: c
    real(dp), intent(in) :: y(unknowns), strain(6)
    real(dp) :: dy(unknowns), along, mobilised
    type(stiffness) :: s
    s = stiffness_of(c, y)
    dy = 0.0_dp
    dy(7) = (1.0_dp + y(7))*sum(strain(1:3))
    if (.not. c%mr > 0.0_dp) then
      dy(1:6) = linear(s, strain) + s%n*magnitude(strain)
      return
    end if
    ! T' = M:D and h' of Niemunis and Herle, with rho = |h|/R and H = h/|h|:
    !     M = (rho^chi m_T + (1 - rho^chi) m_R) L
    !         + rho^chi ((1 - m_T) L:H H + N H)     where H:D > 0
    !         + rho^chi (m_R - m_T) L:H H           elsewhere
    !     h' = D - H (H:D) rho^beta_r               where H:D > 0, D elsewhere
    along = product_of(s%along, strain)
    mobilised = s%rho**c%chi
    dy(1:6) = (mobilised*c%mt + (1.0_dp - mobilised)*c%mr)*linear(s, strain)
    if (along > 0.0_dp) then
      dy(1:6) = dy(1:6) + mobilised*along*((1.0_dp - c%mt)*linear(s, s%along) + s%n)
      dy(8:13) = strain - s%rho**c%betar*along*s%along
    else
      dy(1:6) = dy(1:6) + mobilised*along*(c%mr - c%mt)*linear(s, s%along)
      dy(8:13) = strain
    end if
  end function

  pure function stiffness_of(c, y) result(s)
    type(hypo_constants), intent(in) :: c
    real(dp), intent(in) :: y(unknowns)
    type(stiffness) :: s
    real(dp) :: stress(6), trace, barotropy, e, ed, ec, ei, fd, f, deviator(6), size2
    stress = y(1:6)
    trace = min(sum(stress(1:3)), -3.0_dp*c%lowest)
    stress(1:3) = stress(1:3) + (trace - sum(stress(1:3)))/3.0_dp
    s%ratio = stress/trace
    deviator = s%ratio
    deviator(1:3) = deviator(1:3) - 1.0_dp/3.0_dp
    size2 = product_of(s%ratio, s%ratio)
    ! E. Bauer: e_i/e_i0 = e_c/e_c0 = e_d/e_d0 = exp[-(-tr T/h_s)^n]
    barotropy = (-trace/c%hs)**c%n
    ei = c%ei0*exp(-barotropy)
    ec = ei*c%ec0/c%ei0
    ed = ei*c%ed0/c%ei0
    e = max(ed, min(y(7), ei))
    fd = ((e - ed)/(ec - ed))**c%alpha
    ! f_s = (h_s/n) (e_i/e)^beta (1 + e_i)/e_i (-tr T/h_s)^(1-n) [...]^-1
    s%linear = c%factor*(ei/e)**c%beta*(1.0_dp + ei)/ei*(-trace/c%hs)/barotropy/size2
    f = lode(deviator)
    s%outer = s%linear*c%a**2*s%ratio
    s%n = s%linear*fd*c%a*f*(s%ratio + deviator)
    s%linear = s%linear*f**2
    s%along = 0.0_dp
    s%rho = 0.0_dp
    if (c%mr > 0.0_dp) then
      s%rho = magnitude(y(8:13))
      if (s%rho > 0.0_dp) s%along = y(8:13)/s%rho
      s%rho = min(s%rho/c%radius, 1.0_dp)
    end if
  end function

  ! F = sqrt(tan^2 psi/8 + (2 - tan^2 psi)/(2 + sqrt2 tan psi cos 3theta)) - tan psi/(2 sqrt2), with
  ! tan psi = sqrt3 |R*| and cos 3theta = -sqrt6 tr R*^3/(R*:R*)^(3/2). Compression in all
  ! directions keeps tan psi below sqrt2; beyond it F is what it is there.
  pure real(dp) function lode(deviator)
    real(dp), intent(in) :: deviator(6)
    real(dp) :: size, tangent, cosine
    size = magnitude(deviator)
    cosine = 0.0_dp
    if (size > 1.0e-12_dp) cosine = max(-1.0_dp, min(1.0_dp, &
                                                     -sqrt(6.0_dp)*3.0_dp*determinant(deviator)/size**3))
    tangent = min(sqrt(3.0_dp)*size, 1.414_dp)
    lode = sqrt(tangent**2/8.0_dp + (2.0_dp - tangent**2) &
                /(2.0_dp + sqrt(2.0_dp)*tangent*cosine)) - tangent/(2.0_dp*sqrt(2.0_dp))
  end function

  ! d(stress)/d(strain) with engineering shear for a further step in the direction of `strain`.
  pure function hypo_tangent(c, y, strain) result(tangent)
    type(hypo_constants), intent(in) :: c
    real(dp), intent(in) :: y(unknowns), strain(6)
    real(dp) :: tangent(6, 6), along, mobilised, weight, row(6)
    type(stiffness) :: s
    integer :: i
    s = stiffness_of(c, y)
    row = s%ratio
    tangent = spread(s%outer, 2, 6)*spread(row, 1, 6)
    do i = 1, 6
      tangent(i, i) = tangent(i, i) + s%linear*merge(1.0_dp, 0.5_dp, i <= 3)
    end do
    if (.not. c%mr > 0.0_dp) then
      if (magnitude(strain) > 0.0_dp) &
        tangent = tangent + spread(s%n, 2, 6)*spread(strain/magnitude(strain), 1, 6)
      return
    end if
    along = product_of(s%along, strain)
    mobilised = s%rho**c%chi
    tangent = tangent*(mobilised*c%mt + (1.0_dp - mobilised)*c%mr)
    weight = mobilised*merge(1.0_dp - c%mt, c%mr - c%mt, along > 0.0_dp)
    row = weight*linear(s, s%along)
    if (along > 0.0_dp) row = row + mobilised*s%n
    tangent = tangent + spread(row, 2, 6)*spread(s%along, 1, 6)
  end function

  ! L:D
  pure function linear(s, strain) result(stress)
    type(stiffness), intent(in) :: s
    real(dp), intent(in) :: strain(6)
    real(dp) :: stress(6)
    stress = s%linear*strain + product_of(s%ratio, strain)*s%outer
  end function

  pure real(dp) function product_of(a, b)
    real(dp), intent(in) :: a(6), b(6)
    product_of = dot_product(a(1:3), b(1:3)) + 2.0_dp*dot_product(a(4:6), b(4:6))
  end function

  pure real(dp) function magnitude(a)
    real(dp), intent(in) :: a(6)
    magnitude = sqrt(product_of(a, a))
  end function

  ! Of a deviator, whose cube has three times this trace.
  pure real(dp) function determinant(a)
    real(dp), intent(in) :: a(6)
    determinant = a(1)*(a(2)*a(3) - a(6)**2) - a(4)*(a(4)*a(3) - a(6)*a(5)) &
                  + a(5)*(a(4)*a(6) - a(2)*a(5))
  end function
end module
