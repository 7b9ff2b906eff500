!> The assertions that are not about pairs of numbers: conditions, texts, shapes, expected failures
!> (part of the pFUnit subset).
module funit_conditions
   use, intrinsic :: iso_fortran_env, only: real32, real64
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
   use funit_compare, only: with_message
   use funit_exceptions, only: SourceLocation, catch, throw
   implicit none
   private
   public :: assertTrue, assertFalse, assertAll, assertAny, assertNone, assertNotAll, assertFail
   public :: assertEqual, assertNotEqual, assertSameShape, assertIsNaN, assertIsFinite, assertExceptionRaised
   public :: WhitespaceOptions, TRIM_ALL, KEEP_ALL

   !> how blanks at the ends of texts are compared
   type :: WhitespaceOptions
      integer :: value
   end type WhitespaceOptions
   type(WhitespaceOptions), parameter :: TRIM_ALL = WhitespaceOptions(1), KEEP_ALL = WhitespaceOptions(2)

   interface assertTrue
      module procedure true_scalar, assertAll
   end interface assertTrue

   interface assertFalse
      module procedure false_scalar, assertNone
   end interface assertFalse

   interface assertEqual
      module procedure equal_texts, equal_logicals, equal_logical_arrays
   end interface assertEqual

   interface assertNotEqual
      module procedure not_equal_logicals
   end interface assertNotEqual

   interface assertIsNaN
      module procedure is_nan_32, is_nan_64
   end interface assertIsNaN

   interface assertIsFinite
      module procedure is_finite_32, is_finite_64
   end interface assertIsFinite

   interface assertExceptionRaised
      module procedure any_raised, raised_with_message
   end interface assertExceptionRaised

contains

   subroutine demand(condition, what, message, location)
      logical, intent(in) :: condition
      character(len=*), intent(in) :: what
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      if (.not. condition) call throw(with_message('  '//what, message), location)
   end subroutine demand

   subroutine true_scalar(condition, message, location)
      logical, intent(in) :: condition
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(condition, 'should be true', message, location)
   end subroutine true_scalar

   subroutine false_scalar(condition, message, location)
      logical, intent(in) :: condition
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(.not. condition, 'should be false', message, location)
   end subroutine false_scalar

   subroutine assertAll(conditions, message, location)
      logical, intent(in) :: conditions(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(all(conditions), 'should all be true', message, location)
   end subroutine assertAll

   subroutine assertAny(conditions, message, location)
      logical, intent(in) :: conditions(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(any(conditions), 'one should be true', message, location)
   end subroutine assertAny

   subroutine assertNone(conditions, message, location)
      logical, intent(in) :: conditions(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(.not. any(conditions), 'none should be true', message, location)
   end subroutine assertNone

   subroutine assertNotAll(conditions, message, location)
      logical, intent(in) :: conditions(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(.not. all(conditions), 'one should be false', message, location)
   end subroutine assertNotAll

   subroutine assertFail(message, location)
      character(len=*), intent(in) :: message
      type(SourceLocation), intent(in), optional :: location
      call throw('  '//message, location)
   end subroutine assertFail

   !> Texts are equal but for blanks at both ends; with whitespace=KEEP_ALL, exactly.
   subroutine equal_texts(expected, found, message, location, whitespace)
      character(len=*), intent(in) :: expected, found
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      type(WhitespaceOptions), intent(in), optional :: whitespace
      logical :: same
      same = trim(adjustl(expected)) == trim(adjustl(found))
      if (present(whitespace)) then
         if (whitespace%value == KEEP_ALL%value) same = expected == found .and. len(expected) == len(found)
      end if
      call demand(same, 'expected "'//expected//'"'//new_line('a')//'  found    "'//found//'"', message, location)
   end subroutine equal_texts

   subroutine equal_logicals(expected, actual, message, location)
      logical, intent(in) :: expected, actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(expected .eqv. actual, 'should be equivalent', message, location)
   end subroutine equal_logicals

   subroutine equal_logical_arrays(expected, actual, message, location)
      logical, intent(in) :: expected(:), actual(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      logical :: same
      same = size(expected) == size(actual)
      if (same) same = all(expected .eqv. actual)
      call demand(same, 'should be equivalent everywhere', message, location)
   end subroutine equal_logical_arrays

   subroutine not_equal_logicals(expected, actual, message, location)
      logical, intent(in) :: expected, actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(expected .neqv. actual, 'should not be equivalent', message, location)
   end subroutine not_equal_logicals

   subroutine assertSameShape(shape_a, shape_b, message, location)
      integer, intent(in) :: shape_a(:), shape_b(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      logical :: same
      same = size(shape_a) == 0 .or. size(shape_b) == 0 ! a scalar conforms to everything
      if (.not. same .and. size(shape_a) == size(shape_b)) same = all(shape_a == shape_b)
      call demand(same, 'shapes should be the same', message, location)
   end subroutine assertSameShape

   subroutine is_nan_32(x, message, location)
      real(real32), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(ieee_is_nan(x), 'should be NaN', message, location)
   end subroutine is_nan_32

   subroutine is_nan_64(x, message, location)
      real(real64), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(ieee_is_nan(x), 'should be NaN', message, location)
   end subroutine is_nan_64

   subroutine is_finite_32(x, message, location)
      real(real32), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(ieee_is_finite(x), 'should be finite', message, location)
   end subroutine is_finite_32

   subroutine is_finite_64(x, message, location)
      real(real64), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call demand(ieee_is_finite(x), 'should be finite', message, location)
   end subroutine is_finite_64

   subroutine any_raised(location)
      type(SourceLocation), intent(in), optional :: location
      if (.not. catch()) call throw('  nothing was thrown', location)
   end subroutine any_raised

   subroutine raised_with_message(message, location)
      character(len=*), intent(in) :: message
      type(SourceLocation), intent(in), optional :: location
      if (.not. catch(message)) call throw('  was not thrown: '//message, location)
   end subroutine raised_with_message
end module funit_conditions
