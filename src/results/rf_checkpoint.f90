!> The checkpoint of a run, JOB.rst.h5: the deck's text and all state. From it a run goes on with the same bits (docs/results.md).
!>
!> Writing: `begin_writing`, the types' `exchange`, `finish_writing`. The file gets its name only when it is complete and lies on
!> the disk; the one before is kept as JOB.rst.1.h5, so that a valid one exists at any time. Behind what HDF5 has written stands a
!> line with the checksum of all of it.
!> Reading: `begin_reading` refuses with the reason what is no complete checkpoint of this version, before HDF5 sees it where the
!> checksum does not fit (a damaged file can make the library crash or loop); the types' `exchange` finds what has another kind
!> or size; `finish_reading` what this version does not know. Only then has the state been read.
!> Format 4: the checksum is a CRC-64. 3: the program's version and build come first, the run has an identity. 2: the line with the
!> checksum.
module rf_checkpoint
   use rf_archive, only: archive_t, datum_t
   use rf_kinds, only: i8
   use rf_checksum, only: checksum_t, checksum_of_file
   use rf_text_file, only: text_file_t
   use rf_hdf5_archive, only: hdf5_archive_t
   use rf_provenance, only: provenance_t
   use rf_system, only: path_exists, is_folder, is_pipe, is_readable, remove_file, rename_file, link_file, sync_file, sync_folder
   use rf_text, only: to_text, file_folder
   implicit none
   private
   public :: checkpoint_path, previous_path, remove_unfinished

   !> the layout of the file; to be raised whenever an older program could not read it, or could misread it
   integer, parameter, public :: checkpoint_format = 5
   !> what the file calls itself
   character(len=*), parameter :: what_it_is = 'rfem checkpoint'
   !> the last line of the file: this, the checksum of what stands before the line, and an end of line
   character(len=*), parameter :: seal_words = what_it_is//' ends here, checksum '
   integer, parameter :: seal_length = len(seal_words) + 16 + 1
   !> what every HDF5 file begins with
   character(len=*), parameter :: signature = char(137)//'HDF'

   type, extends(hdf5_archive_t), public :: checkpoint_t
      !> of the run that wrote it: deck, program, machine, start; its text of the deck is the one to be read again
      type(provenance_t) :: origin
      !> a remark for the log, empty if there is none
      character(len=:), allocatable :: note
      !> to be written: the newest one of this name becomes the previous one. Not where it is another one from which the run has
      !> gone on: then the newest is no good, and the previous one may be the only one that is
      logical :: keep_newest = .true.
      !> what was to be read is no file, or a deck: the command line is wrong, not the checkpoint
      logical :: mistaken = .false.
      !> folder and job name of what is written, path of what is read
      character(len=:), allocatable, private :: path
   contains
      procedure :: begin_writing, finish_writing, begin_reading, finish_reading, abandon
      procedure, private :: write_head, take_its_name
   end type checkpoint_t

contains

   !> Path of the checkpoint of a job.
   function checkpoint_path(base) result(path)
      !> folder and job name
      character(len=*), intent(in) :: base
      character(len=:), allocatable :: path
      path = base//'.rst.h5'
   end function checkpoint_path

   !> Path of the one before.
   function previous_path(base) result(path)
      !> folder and job name
      character(len=*), intent(in) :: base
      character(len=:), allocatable :: path
      path = base//'.rst.1.h5'
   end function previous_path

   !> Begin a checkpoint beside the valid one; `error` of the archive tells what fails here and later.
   subroutine begin_writing(self, base, provenance)
      class(checkpoint_t), intent(inout) :: self
      !> folder and job name
      character(len=*), intent(in) :: base
      !> of this run
      type(provenance_t), intent(in) :: provenance
      character(len=:), allocatable :: error
      if (allocated(self%error)) deallocate (self%error)
      self%reading = .false.
      self%path = base
      self%origin = provenance
      self%note = ''
      call self%file%create(unfinished_path(base), error, timeless=.true.)
      if (allocated(error)) then
         call self%fail(error)
         return
      end if
      call self%begin()
      call self%write_head(error)
      if (allocated(error)) call self%fail(error)
      call self%origin%exchange(self)
   end subroutine begin_writing

   !> What a person sees first, and what must be known before anything else is read.
   subroutine write_head(self, error)
      class(checkpoint_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: error
      integer :: format
      call self%file%set_attribute('/', 'what', what_it_is, error)
      if (allocated(error)) return
      call self%file%set_attribute('/', 'program', 'rfem '//self%origin%version//' ('//self%origin%commit//')', error)
      format = checkpoint_format
      call self%exchange('format', format)
      call self%exchange('version', self%origin%version)
   end subroutine write_head

   !> Complete the file, wait until it lies on the disk, keep the one before, give it its name. After an error the valid
   !> checkpoint is the one that was there before.
   subroutine finish_writing(self)
      class(checkpoint_t), intent(inout) :: self
      character(len=:), allocatable :: error
      integer :: items
      items = self%count_items()
      call self%exchange('complete', items)
      call self%close()
      if (.not. allocated(self%error)) then
         call self%file%close(error)
         if (allocated(error)) call self%fail(error)
      end if
      if (.not. allocated(self%error)) then
         call seal(self%file%path, error)
         if (allocated(error)) call self%fail(error)
      end if
      if (.not. allocated(self%error)) call self%take_its_name()
      if (allocated(self%error)) call self%abandon()
   end subroutine finish_writing

   !> Add the line with the checksum.
   subroutine seal(path, error)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      type(text_file_t) :: file
      type(checksum_t) :: sum
      character(len=:), allocatable :: reason
      integer(i8) :: length
      logical :: good
      inquire (file=path, size=length)
      call checksum_of_file(path, length, sum, good, reason)
      if (.not. good) error = path//': cannot be read again: '// &
                           trim(adjustl(reason(index(reason, ': ') + 1:)))      ! which begins with the name too
      if (allocated(error)) return
      call file%append(path, error)
      if (allocated(error)) return
      call file%put_line(seal_words//sum%hex())
      call file%close(error)
   end subroutine seal

   !> Look whether a file is what was sealed; unallocated means that it is.
   subroutine check_seal(path, mistaken, error)
      character(len=*), intent(in) :: path
      !> it was never meant to be one
      logical, intent(inout) :: mistaken
      character(len=:), allocatable, intent(out) :: error
      character(len=seal_length) :: found
      character(len=len(signature)) :: beginning
      type(checksum_t) :: sum
      integer(i8) :: length
      integer :: unit, status
      logical :: good
      inquire (file=path, size=length)
      found = ''
      beginning = ''
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', action='read', iostat=status)
      if (status == 0) then
         read (unit, iostat=status) beginning
         if (status == 0 .and. length > seal_length) read (unit, pos=length - seal_length + 1, iostat=status) found
         close (unit)
      end if
      if (index(beginning, '*') == 1) then
         error = path//': is a deck; a deck is run without --restart, which takes the checkpoint of a run, JOB.rst.h5'
         mistaken = .true.
      else if (status /= 0 .or. beginning /= signature) then
         error = path//': this is no HDF5 file, or its beginning is damaged'
      else if (found(:len(seal_words)) /= seal_words .or. found(seal_length:) /= new_line('a')) then
         error = path//': is no checkpoint of rfem, or it was cut short or not finished'
      else
         call checksum_of_file(path, length - seal_length, sum, good)
         if (.not. good .or. sum%hex() /= found(len(seal_words) + 1:seal_length - 1)) &
            error = path//': the file is damaged: its checksum does not fit'
      end if
   end subroutine check_seal

   !> The finished file replaces the checkpoint, which becomes the previous one: a second name for it first, so that neither is
   !> ever missing; where the file system knows no second names it is renamed.
   subroutine take_its_name(self)
      class(checkpoint_t), intent(inout) :: self
      character(len=:), allocatable :: newest, reason
      newest = checkpoint_path(self%path)
      if (.not. sync_file(self%file%path, reason)) then
         call self%fail(self%file%path//': cannot be written to the disk: '//reason)
         return
      end if
      if (self%keep_newest .and. path_exists(newest)) call make_previous(self%path)
      if (.not. rename_file(self%file%path, newest, reason)) then
         call self%fail(newest//': cannot be replaced by '//self%file%path//': '//reason)
         return
      end if
      if (.not. sync_folder(file_folder(newest), reason)) &
         call self%fail(newest//': its name cannot be written to the disk: '//reason)
   end subroutine take_its_name

   !> Let the newest checkpoint have the name of the previous one, which it replaces at once; under its own name it stays as well.
   subroutine make_previous(base)
      character(len=*), intent(in) :: base
      character(len=:), allocatable :: newest, previous, second
      logical :: done
      newest = checkpoint_path(base)
      previous = previous_path(base)
      second = second_path(base)
      done = remove_file(second)
      if (link_file(newest, second)) then
         done = rename_file(second, previous)
         done = remove_file(second)        ! which stays where both were names of one file already
      else
         done = rename_file(newest, previous)
      end if
   end subroutine make_previous

   !> What a checkpoint is called until it is complete.
   function unfinished_path(base) result(path)
      character(len=*), intent(in) :: base
      character(len=:), allocatable :: path
      path = base//'.rst.tmp.h5'
   end function unfinished_path

   !> What the newest one is called as well until it is the previous one.
   function second_path(base) result(path)
      character(len=*), intent(in) :: base
      character(len=:), allocatable :: path
      path = base//'.rst.1.tmp.h5'
   end function second_path

   !> Delete what a process left that was killed while it wrote a checkpoint.
   subroutine remove_unfinished(base)
      !> folder and job name
      character(len=*), intent(in) :: base
      logical :: gone
      if (path_exists(unfinished_path(base))) gone = remove_file(unfinished_path(base))
      if (path_exists(second_path(base))) gone = remove_file(second_path(base))
   end subroutine remove_unfinished

   !> Close without finishing; an unfinished file is deleted. The error stays.
   subroutine abandon(self)
      class(checkpoint_t), intent(inout) :: self
      character(len=:), allocatable :: ignored
      call self%close()
      if (self%reading) then
         call self%file%close(ignored)
      else
         call self%file%discard()
      end if
   end subroutine abandon

   !> Open a checkpoint; `error` has the reason if it cannot be used.
   subroutine begin_reading(self, path, program)
      class(checkpoint_t), intent(inout) :: self
      !> of the file
      character(len=*), intent(in) :: path
      !> version, commit, compiler and flags of this program
      type(provenance_t), intent(in) :: program
      character(len=:), allocatable :: error
      type(datum_t) :: complete
      if (allocated(self%error)) deallocate (self%error)
      self%reading = .true.
      self%path = path
      self%note = ''
      call open_checkpoint(self, error)
      if (allocated(error)) then
         call self%fail(error)
         return
      end if
      call self%begin()
      call check_format(self, program%version)
      if (.not. allocated(self%error)) then
         call self%look_up('complete', complete)
         if (allocated(self%error)) self%error = self%path//': was not finished ('//self%error//')'
      end if
      if (.not. allocated(self%error)) call self%origin%exchange(self)
      if (.not. allocated(self%error)) self%note = other_program(self%origin, program)
      if (allocated(self%error)) call self%abandon()
   end subroutine begin_reading

   !> Open the file, or say why not.
   subroutine open_checkpoint(self, error)
      class(checkpoint_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: error
      associate (path => self%path)
         if (.not. path_exists(path)) then
            error = path//': there is no such file'
            self%mistaken = .true.
         else if (is_folder(path)) then
            error = path//': is a folder, not a checkpoint'
            self%mistaken = .true.
         else if (is_pipe(path)) then         ! reading it might wait for ever
            error = path//': is a pipe, not a checkpoint'
            self%mistaken = .true.
         else if (.not. is_readable(path)) then
            error = path//': may not be read'
         else
            call check_seal(path, self%mistaken, error)
            if (allocated(error)) return
            call self%file%open(path, .false., error)
            if (allocated(error)) error = damaged(error)
         end if
      end associate
   end subroutine open_checkpoint

   !> What HDF5 says of a file that was cut short or changed, in words that help.
   function damaged(reason) result(text)
      character(len=*), intent(in) :: reason
      character(len=:), allocatable :: text
      text = reason
      if (index(reason, 'truncated') > 0) text = text//': the file was cut short'
      if (index(reason, 'signature not found') > 0) text = text//': this is no HDF5 file, or its beginning is damaged'
      if (index(reason, 'already open for write') > 0) text = text//': it was not finished'
      if (index(reason, 'checksum') > 0) text = text//': the file is damaged'
   end function damaged

   !> Only what this version has written is read, and only the present format. Another version is named before anything else is
   !> looked at, for all else may look otherwise. (Format 1 did not tell it there.)
   subroutine check_format(self, version)
      class(checkpoint_t), intent(inout) :: self
      !> of this program
      character(len=*), intent(in) :: version
      character(len=:), allocatable :: writer
      integer :: format
      call self%exchange('format', format)
      if (allocated(self%error)) then
         self%error = self%path//': is no checkpoint of rfem ('//self%error//')'
         return
      end if
      call self%exchange('version', writer)
      if (allocated(writer)) then
         if (writer /= version) call self%fail(self%path//': was written by rfem '//writer//'; this is rfem '//version// &
                                               ', which does not go on with it')
      else if (.not. allocated(self%error)) then
         call self%fail(self%path//': does not tell the version of rfem that wrote it')
      end if
      if (format == checkpoint_format .or. allocated(writer) .and. allocated(self%error)) return
      self%error = self%path//': is a checkpoint of format '//to_text(format)//'; this version of rfem reads format '// &
                   to_text(checkpoint_format)//' only'
   end subroutine check_format

   !> A remark where the checkpoint was written by another build of the same version: another commit, another compiler or other
   !> flags may compute other bits. Empty if it is the same.
   function other_program(origin, program) result(note)
      !> of the checkpoint, of this program
      type(provenance_t), intent(in) :: origin, program
      character(len=:), allocatable :: note
      note = ''
      call compare('commit', origin%commit, program%commit)
      call compare('compiler', origin%compiler, program%compiler)
      call compare('flags', origin%flags, program%flags)
      if (len(note) > 0) note = 'the checkpoint was written by '//note//': the results may differ in their last bits'

   contains

      subroutine compare(what, theirs, ours)
         character(len=*), intent(in) :: what, theirs, ours
         if (theirs == ours) return
         if (len(note) > 0) note = note//'; '
         note = note//what//' '//theirs//', this is '//ours
      end subroutine compare

   end function other_program

   !> Close what has been read. What the file holds beyond it was written by another program: then the state is not complete.
   subroutine finish_reading(self)
      class(checkpoint_t), intent(inout) :: self
      integer :: read_items, items
      read_items = self%count_items()
      call self%exchange('complete', items)
      if (.not. allocated(self%error) .and. items /= read_items) call self%fail(self%path//': holds '//to_text(items)// &
         ' data, of which this version of rfem reads '//to_text(read_items)//'; it was written by another one')
      if (allocated(self%error)) self%error = damaged(self%error)
      call self%abandon()
   end subroutine finish_reading
end module rf_checkpoint
