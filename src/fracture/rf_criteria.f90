!> The failure criteria there are: the one place where a new one is entered.
module rf_criteria
   use rf_criterion, only: criterion_t
   use rf_criterion_griffith, only: griffith_t
   use rf_criterion_cutoff, only: cutoff_t
   implicit none
   private
   public :: criterion_item_t, criterion_names, standard_criterion, make_criterion

   !> words of *STRENGTH, CRITERION=
   character(len=*), parameter :: criterion_names = 'GRIFFITH CUTOFF'
   !> the paper's
   character(len=*), parameter :: standard_criterion = 'GRIFFITH'

   !> a material's criterion
   type :: criterion_item_t
      class(criterion_t), allocatable :: law
   end type criterion_item_t

contains

   !> The criterion of a name; the law stays unallocated for an unknown one.
   subroutine make_criterion(name, item)
      !> one of criterion_names
      character(len=*), intent(in) :: name
      type(criterion_item_t), intent(inout) :: item
      if (allocated(item%law)) deallocate (item%law)
      select case (name)
      case ('GRIFFITH')
         allocate (griffith_t :: item%law)
      case ('CUTOFF')
         allocate (cutoff_t :: item%law)
      end select
   end subroutine make_criterion

end module rf_criteria
