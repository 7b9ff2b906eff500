!> The names of pFUnit's module `funit` that our tests may use.
!>
!> This is an own, small subset for machines without pFUnit: what it accepts, pFUnit 4.2 and newer accept too.
module funit
   use funit_assertions, only: assertEqual, assertGreaterThan, assertGreaterThanOrEqual, assertLessThan, &
      assertLessThanOrEqual, assertNotEqual, assertRelativelyEqual
   use funit_cases, only: AbstractTestParameter, ParameterizedTestCase, TestCase
   use funit_conditions, only: KEEP_ALL, TRIM_ALL, WhitespaceOptions, assertAll, assertAny, assertEqual, &
      assertExceptionRaised, assertFail, assertFalse, assertIsFinite, assertIsNaN, assertNone, assertNotAll, &
      assertNotEqual, assertSameShape, assertTrue
   use funit_exceptions, only: SourceLocation, anyExceptions, catch, throw
   implicit none
   private
   public :: SourceLocation, anyExceptions, catch, throw
   public :: AbstractTestParameter, ParameterizedTestCase, TestCase
   public :: assertEqual, assertNotEqual, assertRelativelyEqual
   public :: assertLessThan, assertLessThanOrEqual, assertGreaterThan, assertGreaterThanOrEqual
   public :: assertTrue, assertFalse, assertAll, assertAny, assertNone, assertNotAll, assertFail
   public :: assertSameShape, assertIsNaN, assertIsFinite, assertExceptionRaised
   public :: WhitespaceOptions, KEEP_ALL, TRIM_ALL

   !> Names that pFUnit's `funit` has too: a test module that defines one of them, or a `use` without `only:` that brings
   !> one in, would not compile there, so it shall not compile here.
   integer, parameter, public :: run = 0, is = 0, stub = 0, initialize = 0, finalize = 0, generic_run = 0
end module funit
