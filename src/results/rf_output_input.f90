!> Reads what is to be written: `*OUTPUT`, `*MONITOR`, `*SECTION CHECK`, `*NODE PRINT`, `*EL PRINT`.
module rf_output_input
   use rf_kinds, only: wp
   use rf_deck, only: deck_t
   use rf_failure, only: fracture_settings_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   implicit none
   private
   public :: output_settings_t, monitor_t, section_check_t, node_print_t, element_print_t, output_requests_t
   public :: read_output, check_stop_drop

   !> *OUTPUT of a step
   type :: output_settings_t
      !> increments from one frame, or history row, to the next; events likewise (0: none between increments)
      integer :: field_frequency = 1, history_frequency = 1, field_events = 0, history_events = 0
      !> files of the fields
      logical :: vtkhdf = .true., apdl = .false.
   end type output_settings_t

   !> a *MONITOR: history columns in all steps
   type :: monitor_t
      character(len=:), allocatable :: name
      !> node set
      integer :: set = 0
   end type monitor_t

   !> a *SECTION CHECK: history columns in all steps
   type :: section_check_t
      character(len=:), allocatable :: name
      !> point of the line [length], unit normal [-]
      real(wp) :: point(2) = 0, normal(2) = 0
   end type section_check_t

   !> a *NODE PRINT
   type :: node_print_t
      !> steps that it holds for
      integer :: first_step = 0, last_step = 0
      !> node set and its name
      integer :: set = 0
      character(len=:), allocatable :: set_name
      !> increments from one table to the next
      integer :: frequency = 1
      !> displacements, reactions; a line for each node, the sum of the reactions
      logical :: displacements = .false., reactions = .false., nodes = .true., totals = .false.
   end type node_print_t

   !> an *EL PRINT
   type :: element_print_t
      integer :: first_step = 0, last_step = 0
      !> element set and its name
      integer :: set = 0
      character(len=:), allocatable :: set_name
      integer :: frequency = 1
      logical :: stresses = .false., strains = .false.
   end type element_print_t

   !> all that the deck asks for
   type :: output_requests_t
      !> (steps)
      type(output_settings_t), allocatable :: output(:)
      type(monitor_t), allocatable :: monitor(:)
      type(section_check_t), allocatable :: section(:)
      type(node_print_t), allocatable :: node_print(:)
      type(element_print_t), allocatable :: element_print(:)
   end type output_requests_t

contains

   !> Read all requests.
   subroutine read_output(deck, mesh_input, mesh, requests)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(output_requests_t), intent(out) :: requests
      allocate (requests%output(deck%step_count()), requests%monitor(0), requests%section(0), requests%node_print(0), &
                requests%element_print(0))
   end subroutine read_output

   !> STOP DROP needs a monitor, MONITOR= one that exists. Fills in the first monitor where none is named.
   subroutine check_stop_drop(deck, requests, settings)
      type(deck_t), intent(inout) :: deck
      type(output_requests_t), intent(in) :: requests
      !> of read_fracture
      type(fracture_settings_t), intent(inout) :: settings(:)
   end subroutine check_stop_drop
end module rf_output_input
