!> JOB.dat: tables of *NODE PRINT and *EL PRINT in CalculiX's layout.
module rf_print_tables
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_sort, only: sorted_order
   use rf_kinds, only: i8
   use rf_model, only: model_t
   use rf_cst, only: gradients, strain
   use rf_position, only: position_t
   use rf_output_input, only: node_print_t, element_print_t
   use rf_ascii, only: dat_t, dat_displacements, dat_forces, dat_stresses, dat_strains
   implicit none
   private
   public :: print_tables_t

   type :: print_tables_t
      type(node_print_t), allocatable :: nodes(:)
      type(element_print_t), allocatable :: elements(:)
      type(dat_t), private :: file
      logical, private :: open = .false.
      !> step and increment of the last table of each request, (2, requests)
      integer, allocatable, private :: written(:, :)
   contains
      procedure :: create, exchange, go_on, due_in_time, write_tables, close => close_file, discard
      procedure, private :: write_nodes, write_elements, already
   end type print_tables_t

contains

   !> Make the file if the deck asks for tables.
   subroutine create(self, prefix, error)
      class(print_tables_t), intent(inout) :: self
      !> folder and job name
      character(len=*), intent(in) :: prefix
      character(len=:), allocatable, intent(out) :: error
      if (size(self%nodes) + size(self%elements) == 0) return
      call self%file%create(prefix//'.dat', error)
      self%open = .not. allocated(error)
      allocate (self%written(2, size(self%nodes) + size(self%elements)), source=0)
   end subroutine create

   !> To or from a checkpoint. (Derived: nodes and elements follow from the deck, open from whether there are any.)
   subroutine exchange(self, archive)
      class(print_tables_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%enter('file')
      call self%file%exchange(archive)
      call archive%leave()
      call archive%exchange('written', self%written)
   end subroutine exchange

   !> Go on with the file of a checkpoint.
   subroutine go_on(self, prefix, look_only, error)
      class(print_tables_t), intent(inout) :: self
      !> folder and job name
      character(len=*), intent(in) :: prefix
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      if (size(self%nodes) + size(self%elements) == 0) return
      call self%file%go_on(prefix//'.dat', look_only, error)
      self%open = .not. (allocated(error) .or. look_only)
   end subroutine go_on

   !> Whether a table of its own frequency is due at a state of a dynamic step.
   pure logical function due_in_time(self, position)
      class(print_tables_t), intent(in) :: self
      type(position_t), intent(in) :: position
      integer :: i
      due_in_time = .false.
      do i = 1, size(self%nodes)
         associate (this => self%nodes(i))
            due_in_time = due_in_time .or. due(this%first_step, this%last_step, this%frequency, this%frequency_given, position)
         end associate
      end do
      do i = 1, size(self%elements)
         associate (this => self%elements(i))
            due_in_time = due_in_time .or. due(this%first_step, this%last_step, this%frequency, this%frequency_given, position)
         end associate
      end do
   end function due_in_time

   !> Tables that are due at the end of an increment and have not been written there.
   subroutine write_tables(self, model, position, error)
      class(print_tables_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      if (.not. self%open) return
      do i = 1, size(self%nodes)
         if (.not. due(self%nodes(i)%first_step, self%nodes(i)%last_step, self%nodes(i)%frequency, &
                       self%nodes(i)%frequency_given, position)) cycle
         if (self%already(i, position)) cycle
         call self%write_nodes(model, position, self%nodes(i), error)
         if (allocated(error)) return
      end do
      do i = 1, size(self%elements)
         if (.not. due(self%elements(i)%first_step, self%elements(i)%last_step, self%elements(i)%frequency, &
                       self%elements(i)%frequency_given, position)) cycle
         if (self%already(size(self%nodes) + i, position)) cycle
         call self%write_elements(model, position, self%elements(i), error)
         if (allocated(error)) return
      end do
   end subroutine write_tables

   !> Whether a request has had its table of this increment; from now on it has.
   logical function already(self, request, position)
      class(print_tables_t), intent(inout) :: self
      integer, intent(in) :: request
      type(position_t), intent(in) :: position
      already = all(self%written(:, request) == [position%step, position%increment])
      self%written(:, request) = [position%step, position%increment]
   end function already

   !> In a dynamic step a table without FREQUENCY comes with each frame.
   pure logical function due(first_step, last_step, frequency, given, position)
      integer, intent(in) :: first_step, last_step, frequency
      logical, intent(in) :: given
      type(position_t), intent(in) :: position
      logical :: now
      now = mod(position%increment, max(1, frequency)) == 0
      if (position%in_time .and. .not. given) now = position%frame_due
      due = position%step >= first_step .and. position%step <= last_step .and. (now .or. position%last)
   end function due

   subroutine write_nodes(self, model, position, request, error)
      class(print_tables_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      type(node_print_t), intent(in) :: request
      character(len=:), allocatable, intent(out) :: error
      integer, allocatable :: members(:)
      real(wp), allocatable :: values(:, :)
      integer :: i, n
      n = 0
      do i = 1, model%mesh%n_nodes
         if (.not. model%mesh%node_in_set(i, request%set)) cycle
         n = n + 1
         call grow(members, n)
         members(n) = i
      end do
      if (n == 0) return
      members = members(:n)
      members = members(sorted_order(int(model%mesh%node_rank(members), i8)))
      allocate (values(2, n))
      if (request%displacements) then
         values(1, :) = model%motion%ux(members)
         values(2, :) = model%motion%uy(members)
         call self%file%node_table(dat_displacements, request%set_name, position%time, model%mesh%node_id(members), values, error)
         if (allocated(error)) return
      end if
      if (.not. request%reactions) return
      do i = 1, n
         values(:, i) = model%loads%at_support(model%reaction, members(i))
      end do
      if (request%nodes) &
         call self%file%node_table(dat_forces, request%set_name, position%time, model%mesh%node_id(members), values, error)
      if (request%totals .and. .not. allocated(error)) &
         call self%file%total_table(request%set_name, position%time, sum(values, 2), error)
   end subroutine write_nodes

   subroutine write_elements(self, model, position, request, error)
      class(print_tables_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      type(element_print_t), intent(in) :: request
      character(len=:), allocatable, intent(out) :: error
      integer, allocatable :: members(:)
      real(wp), allocatable :: stresses(:, :), strains(:, :)
      integer :: i, n
      n = 0
      do i = 1, model%mesh%n_elements
         if (.not. model%mesh%element_in_set(i, request%set)) cycle
         n = n + 1
         call grow(members, n)
         members(n) = i
      end do
      if (n == 0) return
      members = members(:n)
      members = members(sorted_order(int(model%mesh%element_rank(members), i8)))
      allocate (stresses(6, n), strains(6, n))
      do i = 1, n
         call element_values(model, members(i), stresses(:, i), strains(:, i))
      end do
      if (request%stresses) call self%file%element_table(dat_stresses, request%set_name, position%time, &
                                                         model%mesh%element_id(members), stresses, error)
      if (request%strains .and. .not. allocated(error)) &
         call self%file%element_table(dat_strains, request%set_name, position%time, model%mesh%element_id(members), strains, error)
   end subroutine write_elements

   !> Stresses (tension positive) and strains of an element in the order xx, yy, zz, xy, xz, yz; shear strains as
   !> tensor components, as CalculiX prints them.
   subroutine element_values(model, element, sigma, eps)
      type(model_t), intent(in) :: model
      integer, intent(in) :: element
      real(wp), intent(out) :: sigma(6), eps(6)
      real(wp) :: gradient(2, 3), area, e(3), s(3)
      call gradients(model%mesh%x(:, model%mesh%connectivity(:, element)), gradient, area)
      e = strain(gradient, model%motion%corner_displacements(model%mesh, element))
      s = model%failure%element_stress(:, element)
      sigma = 0
      eps = 0
      associate (section => model%material%section(model%mesh%section(element)))
         sigma(1:4) = [s(1), s(2), model%material%out_of_plane(model%mesh%section(element), element, s), s(3)]
         eps(1:4) = [e(1), e(2), 0.0_wp, 0.5_wp*e(3)]
         if (.not. section%plane_strain) eps(3) = -section%poisson/(1 - section%poisson)*(e(1) + e(2))
      end associate
   end subroutine element_values

   subroutine close_file(self, error)
      class(print_tables_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: error
      if (self%open) call self%file%close(error)
      self%open = .false.
   end subroutine close_file

   subroutine discard(self, keep)
      class(print_tables_t), intent(inout) :: self
      !> leave the files as they are instead of deleting them (default: no)
      logical, intent(in), optional :: keep
      if (self%open) call self%file%discard(keep)
      self%open = .false.
   end subroutine discard

end module rf_print_tables
