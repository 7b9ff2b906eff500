!> The checkpoint of a run, JOB.rst.h5: the deck's text and all state. From it a run goes on with the same bits (docs/results.md).
!>
!> Writing: `begin_writing`, the types' `exchange`, `finish_writing`. The file gets its name only when it is complete and lies on
!> the disk; the one before is kept as JOB.rst.1.h5, so that a valid one exists at any time. Behind what HDF5 has written stands a
!> line with the checksum of all of it.
!> Reading: `begin_reading` refuses with the reason what is no complete checkpoint of this version, before HDF5 sees it where the
!> checksum does not fit (a damaged file can make the library crash or loop); the types' `exchange` finds what has another kind
!> or size; `finish_reading` what this version does not know. Only then has the state been read.
module rf_checkpoint
   use rf_archive, only: archive_t
   use rf_kinds, only: i8
   use rf_checksum, only: checksum_t, checksum_of_file
   use rf_text_file, only: text_file_t
   use rf_hdf5_archive, only: hdf5_archive_t
   use rf_provenance, only: provenance_t
   use rf_system, only: path_exists, is_folder, is_readable, remove_file, rename_file, link_file, sync_file, sync_folder
   use rf_text, only: to_text, file_folder
   implicit none
   private
   public :: checkpoint_path, previous_path

   !> the layout of the file; to be raised whenever an older program could not read it, or could misread it
   integer, parameter, public :: checkpoint_format = 2
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
      !> the file's final name
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
      call self%file%create(base//'.rst.tmp.h5', error, timeless=.true.)
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
   end subroutine write_head

   !> Complete the file, wait until it lies on the disk, keep the one before, give it its name. After an error the valid
   !> checkpoint is the one that was there before.
   subroutine finish_writing(self)
      class(checkpoint_t), intent(inout) :: self
      character(len=:), allocatable :: error
      integer :: items
      items = self%items
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
      integer(i8) :: length
      logical :: good
      inquire (file=path, size=length)
      call checksum_of_file(path, length, sum, good)
      if (.not. good) error = path//': cannot be read again'
      if (allocated(error)) return
      call file%append(path, error)
      if (allocated(error)) return
      call file%put_line(seal_words//sum%hex())
      call file%close(error)
   end subroutine seal

   !> Look whether a file is what was sealed; unallocated means that it is.
   subroutine check_seal(path, error)
      character(len=*), intent(in) :: path
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
      if (status /= 0 .or. beginning /= signature) then
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
      character(len=:), allocatable :: newest, previous, reason
      logical :: done
      newest = checkpoint_path(self%path)
      previous = previous_path(self%path)
      if (.not. sync_file(self%file%path)) then
         call self%fail(self%file%path//': cannot be written to the disk')
         return
      end if
      if (path_exists(newest)) then
         done = remove_file(previous)
         done = link_file(newest, previous)
         if (.not. done) done = rename_file(newest, previous)
      end if
      if (.not. rename_file(self%file%path, newest, reason)) then
         call self%fail(newest//': cannot be replaced by '//self%file%path//': '//reason)
         return
      end if
      if (index(newest, '/') > 0) then
         done = sync_folder(file_folder(newest))
      else
         done = sync_folder('.')
      end if
   end subroutine take_its_name

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
   subroutine begin_reading(self, path, version, commit)
      class(checkpoint_t), intent(inout) :: self
      !> of the file
      character(len=*), intent(in) :: path
      !> of this program
      character(len=*), intent(in) :: version, commit
      character(len=:), allocatable :: error
      integer :: items
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
      call check_format(self)
      if (.not. allocated(self%error)) then
         call self%exchange('complete', items)
         if (allocated(self%error)) self%error = self%path//': was not finished ('//self%error//')'
      end if
      if (.not. allocated(self%error)) call self%origin%exchange(self)
      if (.not. allocated(self%error)) call check_version(self, version, commit)
      self%items = self%items - 1
      if (allocated(self%error)) call self%abandon()
   end subroutine begin_reading

   !> Open the file, or say why not.
   subroutine open_checkpoint(self, error)
      class(checkpoint_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: error
      associate (path => self%path)
         if (.not. path_exists(path)) then
            error = path//': there is no such file'
         else if (is_folder(path)) then
            error = path//': is a folder, not a checkpoint'
         else if (.not. is_readable(path)) then
            error = path//': may not be read'
         else
            call check_seal(path, error)
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

   !> Only the present format is read.
   subroutine check_format(self)
      class(checkpoint_t), intent(inout) :: self
      integer :: format
      call self%exchange('format', format)
      if (allocated(self%error)) then
         self%error = self%path//': is no checkpoint of rfem ('//self%error//')'
      else if (format /= checkpoint_format) then
         call self%fail(self%path//': is a checkpoint of format '//to_text(format)//'; this version of rfem reads format '// &
                        to_text(checkpoint_format)//' only')
      end if
   end subroutine check_format

   !> Another version may compute other bits; another commit of the same version should not, which is worth a remark.
   subroutine check_version(self, version, commit)
      class(checkpoint_t), intent(inout) :: self
      character(len=*), intent(in) :: version, commit
      if (self%origin%version /= version) then
         call self%fail(self%path//': was written by rfem '//self%origin%version//'; this is rfem '//version// &
                        ', which does not go on with it')
      else if (self%origin%commit /= commit) then
         self%note = 'the checkpoint was written by commit '//self%origin%commit//', this is '//commit// &
                     ': the results may differ in their last bits'
      end if
   end subroutine check_version

   !> Close what has been read. What the file holds beyond it was written by another program: then the state is not complete.
   subroutine finish_reading(self)
      class(checkpoint_t), intent(inout) :: self
      integer :: read_items, items
      read_items = self%items
      call self%exchange('complete', items)
      if (.not. allocated(self%error) .and. items /= read_items) call self%fail(self%path//': holds '//to_text(items)// &
         ' data, of which this version of rfem reads '//to_text(read_items)//'; it was written by another one')
      if (allocated(self%error)) self%error = damaged(self%error)
      call self%abandon()
   end subroutine finish_reading
end module rf_checkpoint
