!> Reads the velocities that nodes have when the first dynamic step starts: `*INITIAL CONDITIONS, TYPE=VELOCITY`.
module rf_initial_velocity_input
   use rf_kinds, only: wp
   use rf_catalogue, only: selection_t
   use rf_deck, only: deck_t, card_t
   use rf_dynamics, only: dynamics_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   implicit none
   private
   public :: read_velocity_line

contains

   !> A line of the keyword; of several lines for a node and direction the last holds.
   subroutine read_velocity_line(deck, card, mesh_input, mesh, dynamics)
      type(deck_t), intent(in) :: deck
      type(card_t), intent(inout) :: card
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(dynamics_t), intent(inout) :: dynamics
      type(selection_t) :: selection
      character(len=:), allocatable :: name, problem
      integer, allocatable :: nodes(:)
      integer :: dof, i
      real(wp) :: value
      call card%field_name('node or set', name, about='id of a node, or a set of nodes')
      call card%field_integer('dof', dof, at_least=1, at_most=2, about='1: along x, 2: along y')
      call card%field_real('value', value, unit='length/time', about='velocity when the first dynamic step starts')
      if (card%line_failed .or. card%describing()) return
      if (deck%count_of('DYNAMIC') == 0) call card%error('an initial velocity needs a step with *DYNAMIC, which the deck has not')
      call mesh_input%nodes%resolve(name, selection, problem)
      if (len(problem) > 0) call card%error(problem)
      if (card%line_failed) return
      nodes = mesh_input%nodes%selected(mesh, selection)
      do i = 1, size(nodes)
         call dynamics%give_velocity(mesh%n_nodes, nodes(i), dof, value)
      end do
   end subroutine read_velocity_line

end module rf_initial_velocity_input
