!> The thin layer over HDF5: files, groups, attributes, whole datasets. Growing datasets: rf_hdf5_series.
!>
!> Besides it only rf_hdf5_series, rf_hdf5_archive and rf_hdf5_reason use the library. Nothing here stops: every procedure that can
!> fail hands back `error`, the file and the reason the system gave; unallocated means that all is well. HDF5's own printing is
!> switched off.
module rf_hdf5
   use, intrinsic :: iso_c_binding, only: c_bool, c_int, c_int64_t, c_f_pointer, c_loc, c_ptr, c_null_char, c_char
   use hdf5, only: hid_t, hsize_t, size_t, h5open_f, h5dont_atexit_f, h5fcreate_f, h5fopen_f, h5fclose_f, h5fflush_f, &
      h5fget_obj_count_f, h5gcreate_f, h5gclose_f, h5pcreate_f, h5pclose_f, h5pset_libver_bounds_f, h5pset_fclose_degree_f, &
      h5eset_auto_f, h5screate_f, h5screate_simple_f, h5sclose_f, h5acreate_by_name_f, h5aexists_by_name_f, &
      h5aopen_f, h5aopen_by_name_f, h5aget_type_f, h5aread_f, h5tget_size_f, h5oopen_f, h5oclose_f, &
      h5adelete_by_name_f, h5awrite_f, h5aclose_f, h5dcreate_f, h5dwrite_f, h5dclose_f, h5tcopy_f, h5tclose_f, h5tset_size_f, &
      h5tset_strpad_f, h5tset_cset_f, h5kind_to_type, h5_integer_kind, h5t_native_double, h5t_c_s1, h5t_ieee_f64le, &
      h5t_std_i64le, h5t_str_nullpad_f, h5t_cset_ascii_f, h5t_cset_utf8_f, h5s_scalar_f, h5p_file_access_f, h5p_file_create_f, &
      h5pset_obj_track_times_f, h5f_acc_trunc_f, &
      h5f_acc_rdwr_f, h5f_acc_rdonly_f, h5f_scope_global_f, h5f_libver_v110_f, h5f_close_strong_f, h5f_obj_all_f, &
      h5f_obj_datatype_f
   use rf_kinds, only: wp, i8
   use rf_system, only: is_folder, path_exists, refuse_large_files, remove_file, sync_file
   use rf_text, only: file_folder
   use rf_hdf5_reason, only: hdf5_reason
   implicit none
   private
   public :: hdf5_file_t, hdf5_failure, open_objects

   !> what an id is while nothing is open
   integer(hid_t), parameter, public :: closed_id = -1_hid_t

   !> One HDF5 file that is being written.
   type :: hdf5_file_t
      !> HDF5's id of the open file
      integer(hid_t) :: id = closed_id
      !> where it is
      character(len=:), allocatable :: path
      !> this run made it, so `discard` may delete it
      logical, private :: made_here = .false.
      !> readable by others, and after a crash, while it is written
      logical :: swmr = .false.
   contains
      procedure :: create
      procedure :: open => open_file
      procedure :: reopen
      procedure :: start_swmr
      procedure :: end_swmr
      procedure :: flush => flush_file
      procedure :: sync
      procedure :: close => close_file
      procedure :: discard
      procedure :: is_open
      procedure :: add_group
      procedure, private :: attribute_text, attribute_integer, attribute_long, attribute_integers, attribute_real
      !> set an attribute of a group or dataset; an old one of that name is replaced (not while in SWMR mode)
      generic :: set_attribute => attribute_text, attribute_integer, attribute_long, attribute_integers, attribute_real
      procedure :: get_attribute, remove_attribute
      procedure, private :: dataset_text, dataset_texts, dataset_reals, dataset_integers
      !> write a dataset whose size is known: one text of any length, or a list of texts, reals, integers
      generic :: add_dataset => dataset_text, dataset_texts, dataset_reals, dataset_integers
   end type hdf5_file_t

   interface
      integer(c_int) function c_start_swmr(file) bind(c, name='H5Fstart_swmr_write')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: file
      end function c_start_swmr
      integer(c_int) function c_set_property(list, name, value) bind(c, name='H5Pset')
         import :: c_int, c_int64_t, c_char, c_bool
         integer(c_int64_t), value :: list
         character(kind=c_char), intent(in) :: name(*)
         logical(c_bool), intent(in) :: value
      end function c_set_property
      integer(c_int) function c_increment_size(file, bytes) bind(c, name='H5Fincrement_filesize')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: file, bytes
      end function c_increment_size
      integer(c_int) function c_handle(file, access, handle) bind(c, name='H5Fget_vfd_handle')
         import :: c_int, c_int64_t, c_ptr
         integer(c_int64_t), value :: file, access
         type(c_ptr), intent(out) :: handle
      end function c_handle
      integer(c_int) function c_memfd_create(name, flags) bind(c, name='memfd_create')
         import :: c_int, c_char
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), value :: flags
      end function c_memfd_create
      integer(c_int) function c_dup2(old, new) bind(c, name='dup2')
         import :: c_int
         integer(c_int), value :: old, new
      end function c_dup2
      integer(c_int) function c_close(descriptor) bind(c, name='close')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close
   end interface

contains

   !> Turn a status of HDF5 into an error text, if it is one. Call it right after the failing call: the next one clears the reason.
   subroutine hdf5_failure(status, path, what, error)
      !> what the HDF5 call returned (negative: failed)
      integer, intent(in) :: status
      !> the file
      character(len=*), intent(in) :: path
      !> what was tried, as in 'write the dataset X'
      character(len=*), intent(in) :: what
      !> the text, unallocated if the call went well
      character(len=:), allocatable, intent(out) :: error
      if (status < 0) error = path//': cannot '//what//': '//hdf5_reason()
   end subroutine hdf5_failure

   !> How many HDF5 objects (files, groups, datasets, attributes) are open in the whole program.
   integer function open_objects()
      integer(size_t) :: n, n_types
      integer :: status
      call prepare_library()
      call h5fget_obj_count_f(int(h5f_obj_all_f, hid_t), h5f_obj_all_f, n, status)
      call h5fget_obj_count_f(int(h5f_obj_all_f, hid_t), h5f_obj_datatype_f, n_types, status) ! the library's own
      open_objects = int(n - n_types)
   end function open_objects

   !> Start the library once and silence it. Without its exit handler, which would try again to write what could not be written
   !> and complain or hang; all files are closed by name here.
   subroutine prepare_library()
      integer :: status
      call refuse_large_files()
      call h5dont_atexit_f(status)
      call h5open_f(status)
      call h5eset_auto_f(0, status)
   end subroutine prepare_library

   !> Make a new file (an existing one is replaced). The 1.10 format, which single-writer-multiple-reader mode needs.
   subroutine create(this, path, error, timeless)
      class(hdf5_file_t), intent(out) :: this
      !> where to
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      !> the root keeps no times, so that the same contents make the same bytes
      logical, intent(in), optional :: timeless
      integer(hid_t) :: access, creation
      integer :: status
      call prepare_library()
      this%path = path
      call access_list(access)
      call h5pcreate_f(h5p_file_create_f, creation, status)
      if (present(timeless)) call h5pset_obj_track_times_f(creation, .not. timeless, status)
      call h5fcreate_f(path, h5f_acc_trunc_f, this%id, status, creation, access)
      call hdf5_failure(status, path, 'create this file', error)
      if (allocated(error)) then
         this%id = closed_id
         ! removed while HDF5 was looking at it, the folder leaves HDF5 without the system's words
         if (index(error, 'retrieve stat') > 0 .and. .not. is_folder(file_folder(path))) &
            error = path//': cannot create this file: No such file or directory'
      end if
      this%made_here = .not. allocated(error)
      call h5pclose_f(access, status)
      call h5pclose_f(creation, status)
   end subroutine create

   !> Open an existing file.
   subroutine open_file(this, path, writable, error)
      class(hdf5_file_t), intent(out) :: this
      !> where it is
      character(len=*), intent(in) :: path
      !> to be changed; else for reading alone
      logical, intent(in) :: writable
      character(len=:), allocatable, intent(out) :: error
      integer(hid_t) :: access
      integer :: status
      call prepare_library()
      this%path = path
      call access_list(access)
      call h5fopen_f(path, merge(h5f_acc_rdwr_f, h5f_acc_rdonly_f, writable), this%id, status, access_prp=access)
      call hdf5_failure(status, path, 'open this file', error)
      if (allocated(error)) this%id = closed_id
      call h5pclose_f(access, status)
   end subroutine open_file

   !> Open a file of an earlier process to go on with it. Where that was killed, the marks of a file being written are taken off
   !> and what it wrote last is counted in, as `h5clear -s --increment=0` does; but a file that was cut short is refused. HDF5 does
   !> not keep two processes from it: who goes on with a run has its text files locked before.
   subroutine reopen(this, path, error, look_only)
      class(hdf5_file_t), intent(out) :: this
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      !> for reading; nothing is changed, not even the marks (default: no)
      logical, intent(in), optional :: look_only
      integer(hid_t) :: id
      integer :: ignored
      logical :: to_write
      to_write = .true.
      if (present(look_only)) to_write = .not. look_only
      if (.not. path_exists(path)) then
         this%path = path
         error = path//': is missing; the run cannot go on without it'
         return
      end if
      call this%open(path, to_write, error)
      if (.not. allocated(error)) return
      if (index(error, 'already open') == 0) return
      call open_marked(path, to_write, id)
      if (id == closed_id) return
      if (to_write) then
         call h5fclose_f(id, ignored)
         call this%open(path, .true., error)
      else
         this%id = id
         deallocate (error)
      end if
   end subroutine reopen

   !> Open a file that is marked as being written, of which nobody is the writer any more. Written to, it is not marked any longer.
   subroutine open_marked(path, writable, id)
      character(len=*), intent(in) :: path
      logical, intent(in) :: writable
      !> of the open file, closed_id if that cannot be
      integer(hid_t), intent(out) :: id
      integer(hid_t) :: access
      integer :: status, ignored
      call access_list(access)
      ignored = c_set_property(int(access, c_int64_t), 'clear_status_flags'//c_null_char, .true._c_bool)
      call h5fopen_f(path, merge(h5f_acc_rdwr_f, h5f_acc_rdonly_f, writable), id, status, access_prp=access)
      if (status >= 0) then
         status = c_increment_size(int(id, c_int64_t), 0_c_int64_t)
         if (status < 0) call h5fclose_f(id, ignored)
      end if
      if (status < 0) id = closed_id
      call h5pclose_f(access, ignored)
   end subroutine open_marked

   !> The way files are opened: 1.10 format; closing closes all that is in the file, so that a failed run leaves no ids behind.
   subroutine access_list(access)
      !> property list, to be closed by the caller
      integer(hid_t), intent(out) :: access
      integer :: status
      call h5pcreate_f(h5p_file_access_f, access, status)
      call h5pset_libver_bounds_f(access, h5f_libver_v110_f, h5f_libver_v110_f, status)
      call h5pset_fclose_degree_f(access, h5f_close_strong_f, status)
   end subroutine access_list

   !> From now on every flushed state stays readable whatever happens. No group, dataset or attribute can be added until
   !> `end_swmr`; what is open has to be closed before.
   subroutine start_swmr(this, error)
      class(hdf5_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      call this%flush(error)
      if (allocated(error)) return
      call hdf5_failure(int(c_start_swmr(int(this%id, c_int64_t))), this%path, 'start single-writer mode', error)
      this%swmr = .not. allocated(error)
   end subroutine start_swmr

   !> Back to an ordinary file, to which attributes and datasets can be added. Open series have to be closed before.
   subroutine end_swmr(this, error)
      class(hdf5_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      integer(hid_t) :: access
      integer :: status
      if (.not. this%swmr) return
      call this%close(error)
      if (allocated(error)) return
      call access_list(access)
      call h5fopen_f(this%path, h5f_acc_rdwr_f, this%id, status, access_prp=access)
      call hdf5_failure(status, this%path, 'open this file again', error)
      if (allocated(error)) this%id = closed_id
      call h5pclose_f(access, status)
   end subroutine end_swmr

   !> Hand all that was written to the operating system.
   subroutine flush_file(this, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=:), allocatable, intent(out) :: error
      integer :: status
      call h5fflush_f(this%id, h5f_scope_global_f, status)
      call hdf5_failure(status, this%path, 'write to this file', error)
   end subroutine flush_file

   !> Wait until all that was written lies on the disk.
   subroutine sync(this, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason
      call this%flush(error)
      if (allocated(error)) return
      if (.not. sync_file(this%path, reason)) error = this%path//': cannot be written to the disk: '//reason
   end subroutine sync

   !> Close; what was opened in the file is closed with it. Nothing to do for a closed file. After a failure the file is
   !> given up: HDF5 1.10 crashes when it is asked to close a second time what it could not close.
   subroutine close_file(this, error)
      class(hdf5_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      integer :: status
      if (.not. this%is_open()) return
      call h5fclose_f(this%id, status)
      call hdf5_failure(status, this%path, 'finish this file', error)
      this%id = closed_id
      this%swmr = .false.
   end subroutine close_file

   !> Close and delete what `create` made; errors do not matter any more. HDF5 does not close what it cannot write (full disk, limit
   !> of file sizes), and crashes when asked twice, so first all that it still wants to write is sent to memory; what is kept then
   !> ends with the last flush.
   subroutine discard(this, keep, sound)
      class(hdf5_file_t), intent(inout) :: this
      !> leave the file instead of deleting it (default: no)
      logical, intent(in), optional :: keep
      !> nothing has failed in this file: what is kept is closed as usual (default: no)
      logical, intent(in), optional :: sound
      character(len=:), allocatable :: ignored
      logical :: gone, as_usual
      as_usual = .false.
      if (present(keep) .and. present(sound)) as_usual = keep .and. sound
      if (this%is_open() .and. .not. as_usual) call redirect_to_memory(this%id)
      call this%close(ignored)
      if (present(keep)) this%made_here = this%made_here .and. .not. keep
      if (this%made_here) gone = remove_file(this%path)
      this%made_here = .false.
   end subroutine discard

   !> Let what HDF5 still wants to write to a file go to memory (Linux's memfd) and vanish with it.
   subroutine redirect_to_memory(id)
      !> id of an open file
      integer(hid_t), intent(in) :: id
      type(c_ptr) :: handle
      integer(c_int), pointer :: descriptor
      integer(c_int) :: memory, status
      if (c_handle(int(id, c_int64_t), 0_c_int64_t, handle) < 0) return
      call c_f_pointer(handle, descriptor)
      memory = c_memfd_create('discarded'//c_null_char, 0_c_int)
      if (memory < 0) return
      status = c_dup2(memory, descriptor)
      status = c_close(memory)
   end subroutine redirect_to_memory

   pure logical function is_open(this)
      class(hdf5_file_t), intent(in) :: this
      is_open = this%id /= closed_id
   end function is_open

   !> Add an empty group; the group it lies in has to exist.
   subroutine add_group(this, name, error)
      class(hdf5_file_t), intent(in) :: this
      !> path in the file
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: error
      integer(hid_t) :: group
      integer :: status
      call h5gcreate_f(this%id, name, group, status)
      call hdf5_failure(status, this%path, 'add the group '//name, error)
      if (status >= 0) call h5gclose_f(group, status)
   end subroutine add_group

   subroutine attribute_text(this, owner, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      !> group or dataset that gets the attribute
      character(len=*), intent(in) :: owner
      character(len=*), intent(in) :: name
      !> stored at exactly this length (VTK wants `Type` so); an empty text as one blank
      character(len=*), intent(in) :: value
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable, target :: text
      integer(hid_t) :: text_type
      integer :: status
      text = value
      if (len(text) == 0) text = ' '
      call make_text_type(len(text), is_ascii(text), text_type)
      call put_attribute(this, owner//' '//name, text_type, text_type, 0, c_loc(text), error)
      call h5tclose_f(text_type, status)
   end subroutine attribute_text

   subroutine attribute_integer(this, owner, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: owner
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      character(len=:), allocatable, intent(out) :: error
      call attribute_long(this, owner, name, int(value, i8), error)
   end subroutine attribute_integer

   subroutine attribute_long(this, owner, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: owner
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: value
      character(len=:), allocatable, intent(out) :: error
      integer(i8), target :: copy
      copy = value
      call put_attribute(this, owner//' '//name, h5t_std_i64le, h5kind_to_type(i8, h5_integer_kind), 0, c_loc(copy), error)
   end subroutine attribute_long

   subroutine attribute_integers(this, owner, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: owner
      character(len=*), intent(in) :: name
      integer, intent(in) :: value(:)
      character(len=:), allocatable, intent(out) :: error
      integer(i8), allocatable, target :: copy(:)
      allocate (copy(size(value)))
      copy = int(value, i8)
      call put_attribute(this, owner//' '//name, h5t_std_i64le, h5kind_to_type(i8, h5_integer_kind), size(copy), &
                         c_loc(copy), error)
   end subroutine attribute_integers

   subroutine attribute_real(this, owner, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: owner
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      character(len=:), allocatable, intent(out) :: error
      real(wp), target :: copy
      copy = value
      call put_attribute(this, owner//' '//name, h5t_ieee_f64le, h5t_native_double, 0, c_loc(copy), error)
   end subroutine attribute_real

   !> The text of an attribute; an error if there is no such attribute, or if it is none of fixed length.
   subroutine get_attribute(this, owner, name, text, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: owner, name
      character(len=:), allocatable, intent(out) :: text
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable, target :: buffer
      integer(hid_t) :: attribute, text_type
      integer(size_t) :: length
      integer :: status, ignored
      type(c_ptr) :: place
      text = ''
      call h5aopen_by_name_f(this%id, owner, name, attribute, status)
      call hdf5_failure(status, this%path, 'find the attribute '//name//' of '//owner, error)
      if (allocated(error)) return
      call h5aget_type_f(attribute, text_type, ignored)
      call h5tget_size_f(text_type, length, ignored)
      allocate (character(len=length) :: buffer)
      place = c_loc(buffer)
      call h5aread_f(attribute, text_type, place, status)
      call hdf5_failure(status, this%path, 'read the attribute '//name//' of '//owner, error)
      if (.not. allocated(error)) text = buffer
      call h5tclose_f(text_type, ignored)
      call h5aclose_f(attribute, ignored)
   end subroutine get_attribute

   !> Take an attribute away, if it is there. Not in SWMR mode.
   subroutine remove_attribute(this, owner, name, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: owner, name
      character(len=:), allocatable, intent(out) :: error
      logical :: exists
      integer :: status
      call h5aexists_by_name_f(this%id, owner, name, exists, status)
      if (status >= 0 .and. exists) call h5adelete_by_name_f(this%id, owner, name, status)
      call hdf5_failure(status, this%path, 'take the attribute '//name//' from '//owner, error)
   end subroutine remove_attribute

   !> Write an attribute; one of that name that exists is rewritten in SWMR mode (same type and size) and else replaced.
   subroutine put_attribute(this, place, file_type, memory_type, n, values, error)
      class(hdf5_file_t), intent(in) :: this
      !> owner and name with a blank between
      character(len=*), intent(in) :: place
      !> type in the file
      integer(hid_t), intent(in) :: file_type
      !> type in memory
      integer(hid_t), intent(in) :: memory_type
      !> number of values; 0 means a scalar
      integer, intent(in) :: n
      !> where the values are
      type(c_ptr), intent(in) :: values
      character(len=:), allocatable, intent(out) :: error
      integer(hid_t) :: object, attribute, space
      integer :: status, blank
      logical :: exists
      blank = index(place, ' ')
      associate (owner => place(:blank - 1), name => place(blank + 1:))
         call h5aexists_by_name_f(this%id, owner, name, exists, status)
         if (exists .and. .not. this%swmr) call h5adelete_by_name_f(this%id, owner, name, status)
         if (exists .and. this%swmr) then
            ! opened through its owner: in SWMR mode HDF5 1.10 does not find again what h5aopen_by_name opened
            call h5oopen_f(this%id, owner, object, status)
            call h5aopen_f(object, name, attribute, status)
         else
            call make_space(n, space)
            call h5acreate_by_name_f(this%id, owner, name, file_type, space, attribute, status)
         end if
         call hdf5_failure(status, this%path, 'add the attribute '//name//' to '//owner, error)
         if (.not. allocated(error)) then
            call h5awrite_f(attribute, memory_type, values, status)
            call hdf5_failure(status, this%path, 'write the attribute '//name//' of '//owner, error)
            call h5aclose_f(attribute, status)
         end if
         if (exists .and. this%swmr) then
            call h5oclose_f(object, status)
         else
            call h5sclose_f(space, status)
         end if
      end associate
   end subroutine put_attribute

   !> A dataspace of n values in a row, or of a single one (n = 0).
   subroutine make_space(n, space)
      !> number of values; 0 means a scalar
      integer, intent(in) :: n
      !> to be closed by the caller
      integer(hid_t), intent(out) :: space
      integer :: status
      if (n == 0) then
         call h5screate_f(h5s_scalar_f, space, status)
      else
         call h5screate_simple_f(1, [int(n, hsize_t)], space, status)
      end if
   end subroutine make_space

   !> A text type of fixed length: variable length is neither read by all of VTK's readers nor allowed in SWMR mode.
   subroutine make_text_type(length, ascii, text_type)
      !> characters (bytes)
      integer, intent(in) :: length
      !> no byte above 127; else the text is taken for UTF-8
      logical, intent(in) :: ascii
      !> to be closed by the caller
      integer(hid_t), intent(out) :: text_type
      integer :: status
      call h5tcopy_f(h5t_c_s1, text_type, status)
      call h5tset_size_f(text_type, int(length, size_t), status)
      call h5tset_strpad_f(text_type, h5t_str_nullpad_f, status)
      call h5tset_cset_f(text_type, merge(h5t_cset_ascii_f, h5t_cset_utf8_f, ascii), status)
   end subroutine make_text_type

   pure logical function is_ascii(text)
      character(len=*), intent(in) :: text
      integer :: i
      is_ascii = .true.
      do i = 1, len(text)
         if (iachar(text(i:i)) > 127) is_ascii = .false.
      end do
   end function is_ascii

   subroutine dataset_text(this, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      !> path in the file; its group has to exist
      character(len=*), intent(in) :: name
      !> any length; an empty one is stored as one blank
      character(len=*), intent(in) :: value
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable, target :: text
      integer(hid_t) :: text_type
      integer :: status
      text = value
      if (len(text) == 0) text = ' '
      call make_text_type(len(text), is_ascii(text), text_type)
      call put_dataset(this, name, text_type, text_type, 0, c_loc(text), error)
      call h5tclose_f(text_type, status)
   end subroutine dataset_text

   subroutine dataset_texts(this, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: name
      !> at least one; trailing blanks do not count for readers
      character(len=*), intent(in) :: value(:)
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable, target :: block
      integer(hid_t) :: text_type
      integer :: status, length, i
      logical :: ascii
      length = max(1, maxval(len_trim(value)))
      allocate (character(len=length*size(value)) :: block)
      do i = 1, size(value)
         block((i - 1)*length + 1:i*length) = value(i)//repeat(' ', max(0, length - len(value)))
         block((i - 1)*length + len_trim(value(i)) + 1:i*length) = repeat(c_null_char, length - len_trim(value(i)))
      end do
      ascii = is_ascii(block)
      call make_text_type(length, ascii, text_type)
      call put_dataset(this, name, text_type, text_type, size(value), c_loc(block), error)
      call h5tclose_f(text_type, status)
   end subroutine dataset_texts

   subroutine dataset_reals(this, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: name
      !> at least one
      real(wp), intent(in) :: value(:)
      character(len=:), allocatable, intent(out) :: error
      real(wp), allocatable, target :: copy(:)
      allocate (copy(size(value)))
      copy = value
      call put_dataset(this, name, h5t_ieee_f64le, h5t_native_double, size(copy), c_loc(copy), error)
   end subroutine dataset_reals

   subroutine dataset_integers(this, name, value, error)
      class(hdf5_file_t), intent(in) :: this
      character(len=*), intent(in) :: name
      !> at least one
      integer, intent(in) :: value(:)
      character(len=:), allocatable, intent(out) :: error
      integer(i8), allocatable, target :: copy(:)
      allocate (copy(size(value)))
      copy = int(value, i8)
      call put_dataset(this, name, h5t_std_i64le, h5kind_to_type(i8, h5_integer_kind), size(copy), c_loc(copy), error)
   end subroutine dataset_integers

   subroutine put_dataset(this, name, file_type, memory_type, n, values, error)
      class(hdf5_file_t), intent(in) :: this
      !> path in the file
      character(len=*), intent(in) :: name
      integer(hid_t), intent(in) :: file_type
      integer(hid_t), intent(in) :: memory_type
      !> number of values; 0 means a scalar
      integer, intent(in) :: n
      !> where the values are
      type(c_ptr), intent(in) :: values
      character(len=:), allocatable, intent(out) :: error
      integer(hid_t) :: dataset, space
      integer :: status
      call make_space(n, space)
      call h5dcreate_f(this%id, name, file_type, space, dataset, status)
      call hdf5_failure(status, this%path, 'add the dataset '//name, error)
      if (.not. allocated(error)) then
         call h5dwrite_f(dataset, memory_type, values, status)
         call hdf5_failure(status, this%path, 'write the dataset '//name, error)
         call h5dclose_f(dataset, status)
      end if
      call h5sclose_f(space, status)
   end subroutine put_dataset
end module rf_hdf5
