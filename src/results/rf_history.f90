!> The tables of a run: a row for each equilibrium that is part of the answer, and one for each event (docs/results.md).
module rf_history
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grown_capacity
   use rf_model, only: model_t
   use rf_ray, only: split_t, split_type_name
   use rf_criterion, only: mode_tension
   use rf_relaxation, only: relaxed, scale_memory
   use rf_section_check, only: section_line_t, section_result_t, check_section
   use rf_position, only: position_t
   use rf_monitor, only: monitor_t
   use rf_hdf5, only: hdf5_file_t
   use rf_table, only: table_t, column_t, column, column_integer, column_real, column_text
   use rf_crack_figures, only: count_cracks, crack_length, contact_counts
   use rf_contact, only: pair_open, pair_slip, pair_stick
   implicit none
   private
   public :: history_t, figures_t

   !> Figures of a state that the log shows too.
   type :: figures_t
      integer :: cracks = 0, contacts(0:2) = 0
      !> all since the row before
      integer :: iterations = 0
      real(wp) :: crack_length = 0
      !> largest unbalance of any section check so far, of states within tolerance [-]
      real(wp) :: section_error = 0
      !> largest energy error so far, of states within tolerance [-]
      real(wp) :: energy_error = 0
      !> displacement and reaction of the first monitor
      real(wp) :: u(2) = 0, force(2) = 0
   contains
      procedure :: exchange => exchange_figures
   end type figures_t

   !> What an event's row says of the state before it.
   type :: pending_event_t
      type(split_t) :: split
      !> place of the failed node [length]
      real(wp) :: x(2) = 0
      !> ids of the failed node and the crossed element; nodes and elements before the split
      integer :: node_id = 0, element_id = 0, n_nodes = 0, n_elements = 0
   end type pending_event_t

   type :: history_t
      type(monitor_t), allocatable :: monitors(:)
      type(section_line_t), allocatable :: lines(:)
      type(figures_t) :: figures
      type(table_t), private :: history, events
      !> iterations since the last row
      integer, private :: iterations = 0
      !> reactions of the monitors just before the events, (2, monitors)
      real(wp), allocatable, private :: before(:, :)
      !> events whose rows wait for the equilibrium after them
      type(pending_event_t), allocatable, private :: pending(:)
      integer, private :: n_pending = 0
   contains
      procedure :: create, exchange, go_on, start, row, before_event, write_events, add_iterations, close => close_tables, discard
   end type history_t

   !> columns of the history, each with its kind
   character(len=*), parameter :: integer_columns = ' step increment event_count iterations converged nodes elements cracks &
      &fragments exhausted contacts_open contacts_slip contacts_stick events_tension events_shear '
   character(len=24), parameter :: history_columns(29) = [character(len=24) :: &
      'step', 'increment', 'time', 'load_factor', 'event_count', 'iterations', 'residual', 'converged', 'nodes', 'elements', &
      'cracks', 'crack_length', 'fragments', 'exhausted', 'exhausted_utilisation', 'contacts_open', 'contacts_slip', &
      'contacts_stick', 'events_tension', 'events_shear', 'max_utilisation', 'external_work', 'strain_energy', &
      'kinetic_energy', 'friction_work', 'softening_work', 'released_energy', 'damping_work', 'energy_error']

contains

   !> Make both tables, as CSV files and in the HDF5 file.
   subroutine create(self, prefix, file, error)
      class(history_t), intent(inout) :: self
      !> folder and job name
      character(len=*), intent(in) :: prefix
      !> JOB.h5, open, with the group /rfem
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      type(column_t), allocatable :: columns(:)
      call list_history_columns(self, columns)
      call self%history%create(prefix//'_history.csv', file, '/rfem/history', columns, error)
      if (allocated(error)) return
      call list_event_columns(self, columns)
      call self%events%create(prefix//'_events.csv', file, '/rfem/events', columns, error)
      allocate (self%before(2, size(self%monitors)))
   end subroutine create

   !> To or from a checkpoint. (Derived: monitors, lines follow from the deck.)
   subroutine exchange(self, archive)
      class(history_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call self%figures%exchange(archive)
      call archive%enter('history')
      call self%history%exchange(archive)
      call archive%leave()
      call archive%enter('events')
      call self%events%exchange(archive)
      call archive%leave()
      call archive%exchange('row_iterations', self%iterations)
      call archive%exchange('before', self%before)
      call archive%exchange('n_pending', self%n_pending)
      call exchange_pending(self, archive)
   end subroutine exchange

   subroutine exchange_figures(self, archive)
      class(figures_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('cracks', self%cracks)
      call archive%exchange_fixed('contacts', self%contacts)
      call archive%exchange('iterations', self%iterations)
      call archive%exchange('crack_length', self%crack_length)
      call archive%exchange('section_error', self%section_error)
      call archive%exchange('energy_error', self%energy_error)
      call archive%exchange_fixed('u', self%u)
      call archive%exchange_fixed('force', self%force)
   end subroutine exchange_figures

   !> Events whose rows wait.
   subroutine exchange_pending(self, archive)
      class(history_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      integer :: i
      if (archive%reading .and. self%n_pending > 0) then
         if (allocated(self%pending)) deallocate (self%pending)
         allocate (self%pending(self%n_pending))
      end if
      do i = 1, self%n_pending
         call archive%enter('pending', i)
         call self%pending(i)%split%exchange(archive)
         call archive%exchange_fixed('x', self%pending(i)%x)
         call archive%exchange('node_id', self%pending(i)%node_id)
         call archive%exchange('element_id', self%pending(i)%element_id)
         call archive%exchange('n_nodes', self%pending(i)%n_nodes)
         call archive%exchange('n_elements', self%pending(i)%n_elements)
         call archive%leave()
         if (allocated(archive%error)) return
      end do
   end subroutine exchange_pending

   !> Go on with the files of a checkpoint; `start` follows.
   subroutine go_on(self, prefix, file, look_only, error)
      class(history_t), intent(inout) :: self
      !> folder and job name
      character(len=*), intent(in) :: prefix
      !> JOB.h5, open, not in SWMR mode
      type(hdf5_file_t), intent(in) :: file
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      type(column_t), allocatable :: columns(:)
      call list_history_columns(self, columns)
      call self%history%go_on(prefix//'_history.csv', file, '/rfem/history', columns, look_only, error)
      if (allocated(error)) return
      call list_event_columns(self, columns)
      call self%events%go_on(prefix//'_events.csv', file, '/rfem/events', columns, look_only, error)
   end subroutine go_on

   subroutine list_history_columns(self, columns)
      type(history_t), intent(in) :: self
      type(column_t), allocatable, intent(out) :: columns(:)
      integer :: i, n, kind
      n = size(history_columns)
      allocate (columns(n + 4*(size(self%monitors) + size(self%lines))))
      do i = 1, n
         kind = merge(column_integer, column_real, index(integer_columns, ' '//trim(history_columns(i))//' ') > 0)
         columns(i) = column(trim(history_columns(i)), kind)
      end do
      do i = 1, size(self%monitors)
         call add('u1', self%monitors(i)%name)
         call add('u2', self%monitors(i)%name)
         call add('rf1', self%monitors(i)%name)
         call add('rf2', self%monitors(i)%name)
      end do
      do i = 1, size(self%lines)
         call add('f1', trim(self%lines(i)%name))
         call add('f2', trim(self%lines(i)%name))
         call add('m', trim(self%lines(i)%name))
         call add('error', trim(self%lines(i)%name))
      end do

   contains

      subroutine add(what, name)
         character(len=*), intent(in) :: what, name
         n = n + 1
         columns(n) = column(name//'_'//what)
      end subroutine add

   end subroutine list_history_columns

   subroutine list_event_columns(self, columns)
      type(history_t), intent(in) :: self
      type(column_t), allocatable, intent(out) :: columns(:)
      integer :: i
      columns = [column('event', column_integer), column('step', column_integer), column('increment', column_integer), &
                 column('time'), column('load_factor'), column('node', column_integer), column('x'), column('y'), &
                 column('mode', column_text), column('sigma1'), column('sigma3'), column('utilisation'), &
                 column('direction_deg'), column('element', column_integer), column('type', column_text), &
                 column('new_nodes', column_integer), column('new_elements', column_integer), column('released_energy'), &
                 column('iterations', column_integer)]
      do i = 1, size(self%monitors)
         columns = [columns, column(self%monitors(i)%name//'_rf1'), column(self%monitors(i)%name//'_rf2')]
      end do
   end subroutine list_event_columns

   !> Begin to write, once the HDF5 file is in its final mode.
   subroutine start(self, file, error)
      class(history_t), intent(inout) :: self
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      call self%history%start(file, error)
      if (allocated(error)) return
      call self%events%start(file, error)
   end subroutine start

   !> Count iterations of a relaxation towards the next row.
   subroutine add_iterations(self, n)
      class(history_t), intent(inout) :: self
      integer, intent(in) :: n
      self%iterations = self%iterations + n
   end subroutine add_iterations

   !> A history row.
   subroutine row(self, model, position, file, error)
      class(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      call look(self, model)
      self%figures%iterations = self%iterations
      call put_counts(self, model, position)
      call put_energies(self, model)
      call put_monitors(self, model)
      call put_sections(self, model, position)
      call self%history%end_row(file, error)
      self%iterations = 0
   end subroutine row

   subroutine look(self, model)
      type(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      self%figures%cracks = count_cracks(model%mesh)
      self%figures%crack_length = crack_length(model%mesh)
      self%figures%contacts = contact_counts(model)
      if (model%relaxation%outcome == relaxed) &
         self%figures%energy_error = max(self%figures%energy_error, abs(model%energy%error()))
      if (size(self%monitors) == 0) return
      self%figures%u = self%monitors(1)%displacement(model%mesh, model%motion)
      self%figures%force = self%monitors(1)%force(model%mesh, model%loads, model%reaction)
   end subroutine look

   subroutine put_counts(self, model, position)
      type(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      associate (table => self%history, found => self%figures)
         call table%put(position%step)
         call table%put(position%increment)
         call table%put(position%time)
         call table%put(position%load_factor)
         call table%put(model%events)
         call table%put(self%iterations)
         call table%put(model%relaxation%residual)
         call table%put(merge(1, 0, model%relaxation%outcome == relaxed))
         call table%put(model%mesh%n_nodes)
         call table%put(model%mesh%n_elements)
         call table%put(found%cracks)
         call table%put(found%crack_length)
         call table%put(model%pieces%n)
         call table%put(model%failure%n_exhausted)
         call table%put(model%failure%largest_exhausted)
         call table%put(found%contacts(pair_open))
         call table%put(found%contacts(pair_slip))
         call table%put(found%contacts(pair_stick))
         call table%put(model%events_tension)
         call table%put(model%events_shear)
         call table%put(model%failure%largest)
      end associate
   end subroutine put_counts

   subroutine put_energies(self, model)
      type(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      associate (table => self%history, energy => model%energy)
         call table%put(energy%external)
         call table%put(energy%strain)
         call table%put(energy%kinetic)
         call table%put(energy%friction)
         call table%put(energy%softening)
         call table%put(energy%released)
         call table%put(energy%damping)
         call table%put(energy%error())
      end associate
   end subroutine put_energies

   subroutine put_monitors(self, model)
      type(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp) :: u(2), f(2)
      integer :: i
      do i = 1, size(self%monitors)
         u = self%monitors(i)%displacement(model%mesh, model%motion)
         f = self%monitors(i)%force(model%mesh, model%loads, model%reaction)
         call self%history%put(u(1))
         call self%history%put(u(2))
         call self%history%put(f(1))
         call self%history%put(f(2))
      end do
   end subroutine put_monitors

   !> The state before loading is no equilibrium where there is an initial stress.
   subroutine put_sections(self, model, position)
      type(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      type(section_result_t) :: found
      integer :: i
      do i = 1, size(self%lines)
         call check_section(self%lines(i), model%mesh, model%material, model%motion, model%contact, model%loads, &
                            model%reaction, model%relaxation%b, scale_memory*model%relaxation%largest_scale, found)
         call self%history%put(found%force(1))
         call self%history%put(found%force(2))
         call self%history%put(found%moment)
         call self%history%put(found%error)
         if (model%relaxation%outcome == relaxed .and. position%increment > 0) &
            self%figures%section_error = max(self%figures%section_error, found%error)
      end do
   end subroutine put_sections

   !> Remember what an event's row says of the state before it. Reactions are those of the last equilibrium.
   subroutine before_event(self, model, split)
      class(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(split_t), intent(in) :: split
      integer :: i
      if (self%n_pending == 0) then
         do i = 1, size(self%monitors)
            self%before(:, i) = self%monitors(i)%force(model%mesh, model%loads, model%reaction)
         end do
      end if
      call reserve_pending(self)
      self%n_pending = self%n_pending + 1
      associate (new => self%pending(self%n_pending))
         new%split = split
         new%x = model%mesh%x(:, split%node)
         new%node_id = model%mesh%node_id(split%node)
         new%element_id = model%mesh%element_id(split%element)
         new%n_nodes = model%mesh%n_nodes
         new%n_elements = model%mesh%n_elements
      end associate
   end subroutine before_event

   !> Room for one more event.
   subroutine reserve_pending(self)
      type(history_t), intent(inout) :: self
      type(pending_event_t), allocatable :: larger(:)
      integer :: n
      n = 0
      if (allocated(self%pending)) n = size(self%pending)
      if (self%n_pending < n) return
      allocate (larger(grown_capacity(n, self%n_pending + 1)))
      if (n > 0) larger(:n) = self%pending
      call move_alloc(larger, self%pending)
   end subroutine reserve_pending

   !> The rows of the events since the last equilibrium, once the body has come to rest after them. Of several, the last
   !> one bears what the relaxation tells of all of them.
   subroutine write_events(self, model, position, file, error)
      class(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      do i = 1, self%n_pending
         call write_event(self, model, position, i)
         call self%events%end_row(file, error)
         if (allocated(error)) exit
      end do
      self%n_pending = 0
   end subroutine write_events

   subroutine write_event(self, model, position, place)
      type(history_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      !> among those that wait
      integer, intent(in) :: place
      real(wp), parameter :: to_degrees = 45.0_wp/atan(1.0_wp)
      logical :: last
      integer :: i, nodes, elements
      last = place == self%n_pending
      nodes = model%mesh%n_nodes
      elements = model%mesh%n_elements
      if (.not. last) then
         nodes = self%pending(place + 1)%n_nodes
         elements = self%pending(place + 1)%n_elements
      end if
      associate (table => self%events, event => self%pending(place))
         call table%put(model%events - self%n_pending + place)
         call table%put(position%step)
         call table%put(position%increment)
         call table%put(position%time)
         call table%put(position%load_factor)
         call table%put(event%node_id)
         call table%put(event%x(1))
         call table%put(event%x(2))
         call table%put(merge('tension', 'shear  ', event%split%mode == mode_tension))
         call table%put(event%split%sigma1)
         call table%put(event%split%sigma3)
         call table%put(event%split%utilisation)
         call table%put(to_degrees*atan2(event%split%direction(2), event%split%direction(1)))
         call table%put(event%element_id)
         call table%put(trim(split_type_name(event%split%kind)))
         call table%put(nodes - event%n_nodes)
         call table%put(elements - event%n_elements)
         call table%put(merge(model%energy%released_by_event, 0.0_wp, last))
         call table%put(merge(model%relaxation%iterations, 0, last))
         do i = 1, size(self%monitors)
            call table%put(self%before(1, i))
            call table%put(self%before(2, i))
         end do
      end associate
   end subroutine write_event

   subroutine close_tables(self, error)
      class(history_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable :: second
      call self%history%close(error)
      call self%events%close(second)
      if (.not. allocated(error) .and. allocated(second)) call move_alloc(second, error)
   end subroutine close_tables

   subroutine discard(self, keep)
      class(history_t), intent(inout) :: self
      !> leave the files as they are instead of deleting them (default: no)
      logical, intent(in), optional :: keep
      call self%history%discard(keep)
      call self%events%discard(keep)
   end subroutine discard

end module rf_history
