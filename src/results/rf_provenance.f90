!> Where a run comes from: what JOB.h5 says of deck, program, machine and settings.
module rf_provenance
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_hdf5, only: hdf5_file_t
   use rf_text, only: text_t
   implicit none
   private
   public :: provenance_t

   type :: provenance_t
      !> full text of the deck with all included files; its name
      character(len=:), allocatable :: deck, deck_name
      !> version, commit, compiler and flags of the program
      character(len=:), allocatable :: version, commit, compiler, flags
      !> machine and time of the start; what tells this run from every other one
      character(len=:), allocatable :: host, start_time, run_id
      !> other programs than the first that the run was gone on with, empty if there were none
      character(len=:), allocatable :: continued_by
      integer :: threads = 1
      !> how often the run was gone on with from a checkpoint
      integer :: restarts = 0
      !> all settings: name, value, origin
      type(text_t), allocatable :: setting_names(:), setting_values(:), setting_origins(:)
   contains
      procedure :: write_start, write_end, write_restart, check_run, tells_of_end, exchange
   end type provenance_t

   !> attributes of /rfem that tell of the end of a run, or of a process of it
   character(len=*), parameter :: of_the_end(5) = [character(len=20) :: 'wall_time', 'exit_status', 'digest_displacements', &
                                                   'digest_topology', 'recovered']

contains

   !> What is known before the run.
   subroutine write_start(self, file, error)
      class(provenance_t), intent(in) :: self
      !> JOB.h5, open, with the group /rfem, not in SWMR mode
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      call file%add_dataset('/rfem/deck', self%deck, error)
      call put('deck_name', self%deck_name)
      call put('version', self%version)
      call put('commit', self%commit)
      call put('compiler', self%compiler)
      call put('flags', self%flags)
      call put('host', self%host)
      call put('start_time', self%start_time)
      call put('run_id', self%run_id)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'threads', self%threads, error)
      if (.not. allocated(error)) call file%add_group('/rfem/settings', error)
      call list('name', self%setting_names)
      call list('value', self%setting_values)
      call list('origin', self%setting_origins)

   contains

      subroutine put(name, value)
         character(len=*), intent(in) :: name, value
         if (.not. allocated(error)) call file%set_attribute('/rfem', name, value, error)
      end subroutine put

      subroutine list(name, values)
         character(len=*), intent(in) :: name
         type(text_t), intent(in) :: values(:)
         character(len=:), allocatable :: padded(:)
         integer :: i, longest
         if (allocated(error)) return
         longest = 1
         do i = 1, size(values)
            longest = max(longest, len(values(i)%s))
         end do
         allocate (character(len=longest) :: padded(size(values)))
         do i = 1, size(values)
            padded(i) = values(i)%s
         end do
         call file%add_dataset('/rfem/settings/'//name, padded, error)
      end subroutine list

   end subroutine write_start

   !> What is known after it.
   subroutine write_end(self, file, wall_time, exit_status, error, digests)
      class(provenance_t), intent(in) :: self
      !> open, not in SWMR mode
      type(hdf5_file_t), intent(in) :: file
      !> [s]
      real(wp), intent(in) :: wall_time
      integer, intent(in) :: exit_status
      character(len=:), allocatable, intent(out) :: error
      !> of displacements and of topology; none of a run that is to go on later
      character(len=*), intent(in), optional :: digests(2)
      associate (unused => self)
      end associate
      call file%set_attribute('/rfem', 'wall_time', wall_time, error)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'exit_status', exit_status, error)
      if (.not. present(digests)) return
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'digest_displacements', digests(1), error)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'digest_topology', digests(2), error)
   end subroutine write_end

   !> The run goes on: what was said of its end is true no longer.
   subroutine write_restart(self, file, error)
      class(provenance_t), intent(in) :: self
      !> open, not in SWMR mode
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      do i = 1, size(of_the_end)
         if (.not. allocated(error)) call file%remove_attribute('/rfem', trim(of_the_end(i)), error)
      end do
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'restarts', self%restarts, error)
      if (.not. allocated(error) .and. len(self%continued_by) > 0) &
         call file%set_attribute('/rfem', 'continued_by', self%continued_by, error)
   end subroutine write_restart

   !> An error unless the file is of this run.
   subroutine check_run(self, file, error)
      class(provenance_t), intent(in) :: self
      !> open
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable :: found, started
      call file%get_attribute('/rfem', 'run_id', found, error)
      if (allocated(error)) return
      if (found == self%run_id) return
      call file%get_attribute('/rfem', 'start_time', started, error)
      if (allocated(error)) return
      error = file%path//': is of another run, started at '//started//', than the checkpoint, whose run was started at '// &
              self%start_time//'; the run cannot go on with it'
   end subroutine check_run

   !> Whether the file tells of the end of a run: one that was interrupted, or has gone on since, has no digests.
   logical function tells_of_end(self, file)
      class(provenance_t), intent(in) :: self
      !> open
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable :: digest, error
      associate (unused => self)
      end associate
      call file%get_attribute('/rfem', 'digest_topology', digest, error)
      tells_of_end = .not. allocated(error)
   end function tells_of_end

   !> What a run that goes on has to know of its beginning. (Derived: setting_names, setting_values, setting_origins follow from
   !> the deck.)
   subroutine exchange(self, archive)
      class(provenance_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%enter('provenance')
      call archive%exchange('deck', self%deck)
      call archive%exchange('deck_name', self%deck_name)
      call archive%exchange('version', self%version)
      call archive%exchange('commit', self%commit)
      call archive%exchange('compiler', self%compiler)
      call archive%exchange('flags', self%flags)
      call archive%exchange('run_id', self%run_id)
      call archive%exchange('continued_by', self%continued_by)
      call archive%exchange('host', self%host)
      call archive%exchange('start_time', self%start_time)
      call archive%exchange('threads', self%threads)
      call archive%exchange('restarts', self%restarts)
      call archive%leave()
   end subroutine exchange

end module rf_provenance
