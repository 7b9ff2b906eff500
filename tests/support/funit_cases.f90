!> The types that a test with a fixture extends (part of the pFUnit subset).
module funit_cases
   implicit none
   private
   public :: TestCase, ParameterizedTestCase, AbstractTestParameter

   type, abstract :: TestCase
   contains
      procedure :: setUp => do_nothing
      procedure :: tearDown => do_nothing
   end type TestCase

   type, abstract :: AbstractTestParameter
   contains
      procedure(to_string), deferred :: toString
   end type AbstractTestParameter

   type, abstract, extends(TestCase) :: ParameterizedTestCase
      class(AbstractTestParameter), allocatable :: testParameter
   end type ParameterizedTestCase

   abstract interface
      !> short text that tells this parameter from the others
      function to_string(this) result(string)
         import :: AbstractTestParameter
         implicit none
         class(AbstractTestParameter), intent(in) :: this
         character(:), allocatable :: string
      end function to_string
   end interface

contains

   !> Default fixture: none.
   subroutine do_nothing(this)
      class(TestCase), intent(inout) :: this
      associate (unused => this)
      end associate
   end subroutine do_nothing
end module funit_cases
