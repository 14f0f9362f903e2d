! Mohr-Coulomb: linear elasticity inside the six planes of Mohr and Coulomb, perfectly plastic flow
! with an angle of dilation of its own. In principal stresses, tension positive and
! s(1) >= s(2) >= s(3), the yield function and the direction of flow are
!     f = k s(1) - s(3) - 2 c sqrt(k),   k = (1 + sin phi)/(1 - sin phi),
!     b = (m, 0, -1),                    m = (1 + sin psi)/(1 - sin psi).
! The return to f = 0 is exact: planes, edges and apex are linear in stress, and so is elasticity.
! Planes, edges and apex, and when which: E. A. de Souza Neto, D. Peric and D. R. J. Owen,
! Computational Methods for Plasticity, Wiley 2008, section 8.2; in stresses: J. Clausen,
! L. Damkilde and L. Andersen, Int. J. Numer. Meth. Engng 66 (2006) 1831-1856.
module mohr_coulomb
  implicit none
  private
  public :: mc_constants, mc_from_props, mc_update

  integer, parameter, public :: dp = kind(1.0d0)

  type :: mc_constants
    real(dp) :: bulk, shear, lame  ! K, G, lambda [Pa]
    real(dp) :: k, m               ! slopes of strength and of flow [-]
    real(dp) :: strength           ! 2 c sqrt(k) [Pa]
    real(dp) :: apex               ! stress at the tip, c cot(phi) [Pa]; huge without friction
  end type

  ! What a trial stress turned into: principal stresses, and what d(s)/d(trial) is made of: unity less
  ! steps times the transposed normals of the planes that it was returned to; zero at the apex.
  type :: returned
    real(dp) :: s(3)
    integer :: planes
    logical :: at_apex
    real(dp) :: steps(3, 2), normals(3, 2)
  end type

contains

  ! props: Young modulus [Pa], Poisson ratio, friction angle, dilation angle [deg], cohesion [Pa]
  pure function mc_from_props(props) result(c)
    real(dp), intent(in) :: props(5)
    type(mc_constants) :: c
    real(dp), parameter :: degree = acos(-1.0_dp)/180.0_dp
    real(dp) :: friction, dilation
    friction = sin(props(3)*degree)
    dilation = sin(props(4)*degree)
    c%bulk = props(1)/(3.0_dp*(1.0_dp - 2.0_dp*props(2)))
    c%shear = props(1)/(2.0_dp*(1.0_dp + props(2)))
    c%lame = c%bulk - 2.0_dp/3.0_dp*c%shear
    c%k = (1.0_dp + friction)/(1.0_dp - friction)
    c%m = (1.0_dp + dilation)/(1.0_dp - dilation)
    c%strength = 2.0_dp*props(5)*sqrt(c%k)
    c%apex = huge(1.0_dp)
    if (c%k > 1.0_dp) c%apex = c%strength/(c%k - 1.0_dp)
  end function

  ! One step. Stress [Pa] and strain increment (tensor components): 11 22 33 12 13 23, tension
  ! positive. stored [J/m3] at the end, dissipated [J/m3] in the step, tangent d(stress)/d(strain)
  ! with engineering shear strain.
  pure subroutine mc_update(c, stress, strain, stored, dissipated, tangent)
    type(mc_constants), intent(in) :: c
    real(dp), intent(inout) :: stress(6)
    real(dp), intent(in) :: strain(6)
    real(dp), intent(out) :: stored, dissipated
    real(dp), intent(out), optional :: tangent(6, 6)
    real(dp) :: old(6), trial(6), s(3), axes(3, 3), before, after
    type(returned) :: r
    old = stress
    trial = old + 2.0_dp*c%shear*strain
    trial(1:3) = trial(1:3) + c%lame*sum(strain(1:3))
    call principal(trial, s, axes)
    if (c%k*s(1) - s(3) <= c%strength) then
      stress = trial
      dissipated = 0.0_dp
      r = returned(s, 0, .false., 0.0_dp, 0.0_dp)
    else
      r = return_of(c, s)
      stress = turned(r%s, axes)
      ! The plastic strain is the elastic strain of what was taken away; the work on it by the
      ! trapezoidal rule, or by the stress at the end where that before opposed the flow.
      before = work(c, old, trial - stress)
      after = work(c, stress, trial - stress)
      dissipated = after
      if (before > 0.0_dp) dissipated = 0.5_dp*(before + after)
    end if
    stored = 0.5_dp*work(c, stress, stress)
    if (present(tangent)) tangent = tangent_of(c, s, r, axes)
  end subroutine

  ! a : C^-1 : b
  pure real(dp) function work(c, a, b)
    type(mc_constants), intent(in) :: c
    real(dp), intent(in) :: a(6), b(6)
    real(dp) :: product
    product = dot_product(a(1:3), b(1:3)) + 2.0_dp*dot_product(a(4:6), b(4:6))
    work = product/(2.0_dp*c%shear) + sum(a(1:3))*sum(b(1:3))/3.0_dp &
           *(1.0_dp/(3.0_dp*c%bulk) - 1.0_dp/(2.0_dp*c%shear))
  end function

  ! Of a trial beyond the plane of s(1) and s(3): back to the plane if the order of the stresses
  ! survives it, else to one of the plane's edges, else to the apex.
  pure function return_of(c, trial) result(r)
    type(mc_constants), intent(in) :: c
    real(dp), intent(in) :: trial(3)
    type(returned) :: r
    real(dp) :: determinant, m(2, 2), over(2), steps(3, 2)
    r%at_apex = .false.
    r%planes = 1
    r%normals(:, 1) = [c%k, 0.0_dp, -1.0_dp]
    steps(:, 1) = elastic(c, [c%m, 0.0_dp, -1.0_dp])
    m(1, 1) = dot_product(r%normals(:, 1), steps(:, 1))
    over(1) = dot_product(r%normals(:, 1), trial) - c%strength
    r%steps(:, 1) = steps(:, 1)/m(1, 1)
    r%s = trial - over(1)*r%steps(:, 1)
    if (r%s(1) >= r%s(2) .and. r%s(2) >= r%s(3)) return
    r%planes = 2
    if (r%s(2) > r%s(1)) then  ! the edge s(1) = s(2), of triaxial compression
      r%normals(:, 2) = [0.0_dp, c%k, -1.0_dp]
      steps(:, 2) = elastic(c, [0.0_dp, c%m, -1.0_dp])
    else                       ! the edge s(2) = s(3), of triaxial extension
      r%normals(:, 2) = [c%k, -1.0_dp, 0.0_dp]
      steps(:, 2) = elastic(c, [c%m, -1.0_dp, 0.0_dp])
    end if
    ! s = trial - D B (A^T D B)^-1 f with the normals A, the flows B and the elasticity D
    m(2, 1) = dot_product(r%normals(:, 2), steps(:, 1))
    m(1, 2) = dot_product(r%normals(:, 1), steps(:, 2))
    m(2, 2) = dot_product(r%normals(:, 2), steps(:, 2))
    over(2) = dot_product(r%normals(:, 2), trial) - c%strength
    determinant = m(1, 1)*m(2, 2) - m(1, 2)*m(2, 1)
    r%steps(:, 1) = (steps(:, 1)*m(2, 2) - steps(:, 2)*m(2, 1))/determinant
    r%steps(:, 2) = (steps(:, 2)*m(1, 1) - steps(:, 1)*m(1, 2))/determinant
    r%s = trial - over(1)*r%steps(:, 1) - over(2)*r%steps(:, 2)
    if (r%s(1) <= c%apex) return
    r%s = c%apex
    r%at_apex = .true.
  end function

  ! Stress of a principal strain.
  pure function elastic(c, strain) result(stress)
    type(mc_constants), intent(in) :: c
    real(dp), intent(in) :: strain(3)
    real(dp) :: stress(3)
    stress = 2.0_dp*c%shear*strain + c%lame*sum(strain)
  end function

  ! Consistent tangent of a function of the trial stress t that keeps its axes n_i: with
  ! N_ij = sym(n_i n_j) it is
  !     d(s_i)/d(t_k) D_kj N_ii N_jj + 4 G (s_i - s_j)/(t_i - t_j) N_ij N_ij (i < j),
  ! and the limit of that quotient where two trial stresses are equal [de Souza Neto et al. 2008,
  ! appendix A].
  pure function tangent_of(c, t, r, axes) result(tangent)
    type(mc_constants), intent(in) :: c
    real(dp), intent(in) :: t(3), axes(3, 3)
    type(returned), intent(in) :: r
    real(dp) :: tangent(6, 6), slope(3, 3), stiff(3, 3), n(6, 6), column(6), turn
    integer, parameter :: row(3) = [1, 1, 2], next(3) = [2, 3, 3]
    integer :: i, j
    slope = unit()
    do i = 1, r%planes
      slope = slope - spread(r%steps(:, i), 2, 3)*spread(r%normals(:, i), 1, 3)
    end do
    if (r%at_apex) slope = 0.0_dp
    do i = 1, 3
      n(:, i) = dyad(axes(:, i), axes(:, i))
      n(:, 3 + i) = dyad(axes(:, row(i)), axes(:, next(i)))
    end do
    stiff = 2.0_dp*c%shear*slope + c%lame*spread(sum(slope, 2), 2, 3)
    tangent = 0.0_dp
    do j = 1, 3
      column = n(:, 1)*stiff(1, j) + n(:, 2)*stiff(2, j) + n(:, 3)*stiff(3, j)
      call add(tangent, column, n(:, j))
      turn = slope(row(j), row(j)) - slope(row(j), next(j))
      if (abs(t(row(j)) - t(next(j))) > 1.0e-9_dp*maxval(abs(t))) &
        turn = (r%s(row(j)) - r%s(next(j)))/(t(row(j)) - t(next(j)))
      call add(tangent, 4.0_dp*c%shear*turn*n(:, 3 + j), n(:, 3 + j))
    end do
  end function

  ! sum = sum + column row^T
  pure subroutine add(sum, column, row)
    real(dp), intent(inout) :: sum(6, 6)
    real(dp), intent(in) :: column(6), row(6)
    integer :: i
    do i = 1, 6
      sum(:, i) = sum(:, i) + row(i)*column
    end do
  end subroutine

  ! sym(a b)
  pure function dyad(a, b) result(tensor)
    real(dp), intent(in) :: a(3), b(3)
    real(dp) :: tensor(6)
    tensor(1:3) = a*b
    tensor(4:6) = 0.5_dp*[a(1)*b(2) + a(2)*b(1), a(1)*b(3) + a(3)*b(1), a(2)*b(3) + a(3)*b(2)]
  end function

  ! Principal values, largest first, and axes (columns) of a symmetric tensor, by Jacobi's rotations.
  pure subroutine principal(tensor, values, axes)
    real(dp), intent(in) :: tensor(6)
    real(dp), intent(out) :: values(3), axes(3, 3)
    real(dp) :: a(3, 3), size2
    integer :: sweep, i, order(3)
    a = reshape([tensor(1), tensor(4), tensor(5), tensor(4), tensor(2), tensor(6), tensor(5), &
                 tensor(6), tensor(3)], [3, 3])
    axes = unit()
    size2 = sum(a**2)
    do sweep = 1, 12  ! quadratic convergence: four are enough
      if (a(1, 2)**2 + a(1, 3)**2 + a(2, 3)**2 <= 1.0e-34_dp*size2) exit
      call rotate(a, axes, 1, 2)
      call rotate(a, axes, 1, 3)
      call rotate(a, axes, 2, 3)
    end do
    values = [a(1, 1), a(2, 2), a(3, 3)]
    order = [1, 2, 3]
    do i = 1, 3
      sweep = 1 + mod(i + 1, 2)  ! compare places 1-2, 2-3, 1-2
      if (values(order(sweep)) < values(order(sweep + 1))) &
        order(sweep:sweep + 1) = order(sweep + 1:sweep:-1)
    end do
    values = values(order)
    axes = axes(:, order)
  end subroutine

  ! Rotates a in the plane of p and q so that a(p, q) is zero, and the axes with it.
  pure subroutine rotate(a, axes, p, q)
    real(dp), intent(inout) :: a(3, 3), axes(3, 3)
    integer, intent(in) :: p, q
    real(dp) :: cotangent, t, cosine, sine, kept(3)
    if (abs(a(p, q)) < tiny(1.0_dp)) return
    cotangent = (a(q, q) - a(p, p))/(2.0_dp*a(p, q))
    t = sign(1.0_dp, cotangent)/(abs(cotangent) + sqrt(1.0_dp + cotangent**2))
    cosine = 1.0_dp/sqrt(1.0_dp + t**2)
    sine = t*cosine
    kept = a(:, p)
    a(:, p) = cosine*kept - sine*a(:, q)
    a(:, q) = sine*kept + cosine*a(:, q)
    kept = a(p, :)
    a(p, :) = cosine*kept - sine*a(q, :)
    a(q, :) = sine*kept + cosine*a(q, :)
    a(p, q) = 0.0_dp
    a(q, p) = 0.0_dp
    kept = axes(:, p)
    axes(:, p) = cosine*kept - sine*axes(:, q)
    axes(:, q) = sine*kept + cosine*axes(:, q)
  end subroutine

  ! The tensor of principal values along axes.
  pure function turned(values, axes) result(tensor)
    real(dp), intent(in) :: values(3), axes(3, 3)
    real(dp) :: tensor(6)
    integer :: i
    tensor = 0.0_dp
    do i = 1, 3
      tensor = tensor + values(i)*dyad(axes(:, i), axes(:, i))
    end do
  end function

  pure function unit() result(one)
    real(dp) :: one(3, 3)
    one = reshape([1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp], [3, 3])
  end function
end module
