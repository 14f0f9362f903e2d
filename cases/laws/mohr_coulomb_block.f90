! Mohr-Coulomb through grainpair's own interface, mpm/external_law.h: whole blocks of points,
! compression positive, tensor components xx yy zz xy yz zx. The same constants.
integer(c_int) function grainpair_law(block) bind(c, name="grainpair_law") result(failed)
  use, intrinsic :: iso_c_binding, only: c_int, c_double, c_ptr, c_f_pointer
  use mohr_coulomb, only: dp, mc_constants, mc_from_props, mc_update
  implicit none
  ! The struct grainpair_block of the header.
  type, bind(c) :: grainpair_block
    integer(c_int) :: size
    real(c_double) :: dt
    integer(c_int) :: constant_count
    type(c_ptr) :: constants
    integer(c_int) :: state_count
    type(c_ptr) :: strain(6), spin(3), void_ratio_old, void_ratio, stress(6), state
    type(c_ptr) :: modulus, stored, dissipated
  end type
  type(grainpair_block), intent(inout) :: block
  type :: component
    real(dp), pointer :: of(:)
  end type
  integer, parameter :: order(6) = [1, 2, 3, 4, 6, 5]  ! to 11 22 33 12 13 23
  type(component) :: stress(6), strain(6)
  real(dp), pointer :: constants(:), modulus(:), stored(:), dissipated(:)
  real(dp) :: s(6), e(6)
  type(mc_constants) :: c
  integer :: i, point
  failed = 0
  call c_f_pointer(block%constants, constants, [block%constant_count])
  call c_f_pointer(block%modulus, modulus, [block%size])
  call c_f_pointer(block%stored, stored, [block%size])
  call c_f_pointer(block%dissipated, dissipated, [block%size])
  do i = 1, 6
    call c_f_pointer(block%stress(order(i)), stress(i)%of, [block%size])
    call c_f_pointer(block%strain(order(i)), strain(i)%of, [block%size])
  end do
  c = mc_from_props(constants(1:5))
  modulus = c%lame + 2.0_dp*c%shear
  do point = 1, block%size
    s = [(-stress(i)%of(point), i=1, 6)]
    e = [(-strain(i)%of(point), i=1, 6)]
    call mc_update(c, s, e, stored(point), dissipated(point))
    do i = 1, 6
      stress(i)%of(point) = -s(i)
    end do
  end do
end function
