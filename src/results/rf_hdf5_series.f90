!> Growing datasets of an HDF5 file: rows are appended at the end. The columns of tables and the fields of frames are such series.
!>
!> Life: `create` (all series of a file, before its SWMR mode starts), `open` (after it), `append`, `close`. Rows are (component,
!> row) arrays, or plain arrays for series of one component. While the file is in SWMR mode each append is handed on at once, unless
!> the series is `held`.
module rf_hdf5_series
   use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_loc, c_ptr
   use, intrinsic :: iso_fortran_env, only: real32
   use hdf5, only: hid_t, hsize_t, size_t, h5screate_simple_f, h5sclose_f, h5sselect_hyperslab_f, h5pcreate_f, h5pclose_f, &
      h5pset_chunk_f, h5pset_shuffle_f, h5pset_deflate_f, h5dcreate_f, h5dopen_f, h5dclose_f, h5dset_extent_f, h5dget_space_f, &
      h5dwrite_f, h5sget_simple_extent_dims_f, h5tcopy_f, h5tclose_f, h5tset_size_f, h5tset_strpad_f, h5kind_to_type, &
      h5_integer_kind, h5t_native_double, h5t_native_real, h5t_native_integer, h5t_c_s1, h5t_ieee_f64le, h5t_ieee_f32le, &
      h5t_std_i64le, h5t_std_i32le, h5t_std_u8le, h5t_str_nullpad_f, h5p_dataset_create_f, h5s_select_set_f, h5s_unlimited_f, &
      h5p_dataset_access_f, h5pset_chunk_cache_f, h5pget_chunk_f, h5dget_create_plist_f, h5dget_type_f, h5tget_size_f
   use rf_kinds, only: wp, i1, i8
   use rf_hdf5, only: hdf5_file_t, hdf5_failure, closed_id
   use rf_text, only: to_text
   implicit none
   private

   !> What a series holds. Integers of one width stay together with reals of one width: what is put in is converted.
   integer, parameter, public :: real_64 = 1, real_32 = 2, integer_64 = 3, integer_32 = 4, byte_8 = 5, text_series = 6

   !> zlib's fastest level: with shuffled bytes the higher ones cost time and save next to nothing
   integer, parameter :: deflate_level = 1
   !> places in the table by which HDF5 finds the pieces that it keeps
   integer(size_t), parameter :: cache_slots = 11

   !> One growing dataset.
   type, public :: hdf5_series_t
      !> rows written so far
      integer(i8) :: rows = 0
      integer(hid_t), private :: id = closed_id
      !> path in the file
      character(len=:), allocatable :: name
      !> real_64, real_32, integer_64, integer_32, byte_8 or text_series
      integer :: element = real_64
      !> components of a row; 0: a plain array (one component, dataset of rank 1)
      integer :: components = 0
      !> characters of an entry of a text series
      integer :: text_length = 1
      !> rows wait for the file's own flush even in SWMR mode: for short rows of several series that belong together
      logical :: held = .false.
   contains
      procedure :: create
      procedure :: open => open_series
      procedure :: cut
      procedure :: close => close_series
      procedure, private :: append_reals, append_real_rows, append_integers, append_integer_rows, append_longs, &
         append_bytes, append_texts
      !> add rows at the end
      generic :: append => append_reals, append_real_rows, append_integers, append_integer_rows, append_longs, &
         append_bytes, append_texts
      procedure, private :: append_memory
   end type hdf5_series_t

   interface
      integer(c_int) function c_dataset_flush(dataset) bind(c, name='H5Dflush')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: dataset
      end function c_dataset_flush
   end interface

contains

   !> Make the dataset in the file, with no rows yet. Name, element, components and text_length have been set.
   subroutine create(this, file, chunk_rows, compressed, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> rows that are stored (and compressed) as one piece
      integer, intent(in) :: chunk_rows
      !> shuffle and deflate. In SWMR mode a piece that is filled bit by bit is written anew each time and its old place is lost, so
      !> series that grow row by row are not compressed
      logical, intent(in) :: compressed
      character(len=:), allocatable, intent(out) :: error
      integer(hid_t) :: space, properties, dataset, file_type
      integer(hsize_t) :: extent(2), largest(2), chunk(2)
      integer :: rank, status, ignored
      rank = merge(1, 2, this%components == 0)
      extent(1) = this%components; largest(1) = this%components; chunk(1) = this%components
      extent(rank) = 0; largest(rank) = h5s_unlimited_f; chunk(rank) = chunk_rows
      call h5screate_simple_f(rank, extent(:rank), space, ignored, largest(:rank))
      call h5pcreate_f(h5p_dataset_create_f, properties, ignored)
      call h5pset_chunk_f(properties, rank, chunk(:rank), ignored)
      if (compressed) then
         call h5pset_shuffle_f(properties, ignored)
         call h5pset_deflate_f(properties, deflate_level, ignored)
      end if
      call stored_type(this%element, this%text_length, file_type)
      call h5dcreate_f(file%id, this%name, file_type, space, dataset, status, dcpl_id=properties)
      call hdf5_failure(status, file%path, 'add the dataset '//this%name, error)
      if (status >= 0) call h5dclose_f(dataset, ignored)
      if (this%element == text_series) call h5tclose_f(file_type, ignored)
      call h5pclose_f(properties, ignored)
      call h5sclose_f(space, ignored)
      this%rows = 0
   end subroutine create

   !> Open the dataset for appending; `rows` becomes what the file holds.
   subroutine open_series(this, file, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      integer(hid_t) :: space
      integer(hsize_t) :: extent(2), largest(2)
      integer :: status
      call h5dopen_f(file%id, this%name, this%id, status)
      if (status >= 0) call reopen_with_small_cache(this, file, status)
      call hdf5_failure(status, file%path, 'open the dataset '//this%name, error)
      if (allocated(error)) then
         this%id = closed_id
         return
      end if
      extent = 0
      call h5dget_space_f(this%id, space, status)
      call h5sget_simple_extent_dims_f(space, extent, largest, status)
      call h5sclose_f(space, status)
      this%rows = extent(merge(1, 2, this%components == 0))
   end subroutine open_series

   !> What has been appended is not looked at again, so the two newest pieces are all that need be in memory. By default HDF5
   !> would keep 1 MB of each dataset, which fills up in the course of the run.
   subroutine reopen_with_small_cache(this, file, status)
      type(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> below 0: it could not be opened
      integer, intent(out) :: status
      integer(hid_t) :: properties, stored
      integer(hsize_t) :: piece(2)
      integer(size_t) :: bytes
      integer :: rank, ignored
      rank = merge(1, 2, this%components == 0)
      piece = 1
      call h5dget_create_plist_f(this%id, properties, ignored)
      call h5pget_chunk_f(properties, rank, piece(:rank), ignored)
      call h5pclose_f(properties, ignored)
      call h5dget_type_f(this%id, stored, ignored)
      call h5tget_size_f(stored, bytes, ignored)
      call h5tclose_f(stored, ignored)
      call h5dclose_f(this%id, ignored)
      call h5pcreate_f(h5p_dataset_access_f, properties, ignored)
      call h5pset_chunk_cache_f(properties, cache_slots, 2*bytes*product(piece), 1.0, ignored)      ! 1: whole pieces go first
      call h5dopen_f(file%id, this%name, this%id, status, dapl_id=properties)
      call h5pclose_f(properties, ignored)
   end subroutine reopen_with_small_cache

   !> Go on with a dataset of an earlier process: rows after the first so many are cut off.
   subroutine cut(this, file, rows, look_only, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> rows that the checkpoint knows
      integer(i8), intent(in) :: rows
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      integer(hsize_t) :: extent(2)
      integer :: status, rank
      call this%open(file, error)
      if (allocated(error)) return
      if (this%rows < rows) then
         error = file%path//': the dataset '//this%name//' has '//to_text(this%rows)//' rows, the checkpoint knows '// &
                 to_text(rows)//'; the run cannot go on with it'
      else if (this%rows > rows .and. .not. look_only) then
         rank = merge(1, 2, this%components == 0)
         extent(1) = this%components
         extent(rank) = rows
         call h5dset_extent_f(this%id, extent(:rank), status)
         call hdf5_failure(status, file%path, 'shorten the dataset '//this%name, error)
      end if
      this%rows = rows
      call this%close()
   end subroutine cut

   subroutine close_series(this)
      class(hdf5_series_t), intent(inout) :: this
      integer :: status
      if (this%id /= closed_id) call h5dclose_f(this%id, status)
      this%id = closed_id
   end subroutine close_series

   !> Type in the file. Text types are new ones, which the caller closes.
   subroutine stored_type(element, text_length, file_type)
      integer, intent(in) :: element
      !> characters, of text_series
      integer, intent(in) :: text_length
      integer(hid_t), intent(out) :: file_type
      integer :: status
      select case (element)
      case (real_64); file_type = h5t_ieee_f64le
      case (real_32); file_type = h5t_ieee_f32le
      case (integer_64); file_type = h5t_std_i64le
      case (integer_32); file_type = h5t_std_i32le
      case (byte_8); file_type = h5t_std_u8le
      case default
         call h5tcopy_f(h5t_c_s1, file_type, status)
         call h5tset_size_f(file_type, int(text_length, size_t), status)
         call h5tset_strpad_f(file_type, h5t_str_nullpad_f, status)
      end select
   end subroutine stored_type

   subroutine append_reals(this, file, values, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> one value a row; of a series with components the rest of each row is zero
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable, intent(out) :: error
      real(wp), allocatable, target :: copy(:)
      real(real32), allocatable, target :: short(:)
      integer :: status
      if (this%components > 1) then
         call append_real_rows(this, file, reshape(values, [1, size(values)]), error)
      else if (this%element == real_32) then
         allocate (short(size(values)), stat=status)
         if (out_of_memory(status, file, this%name, error)) return
         short = to_single(values)
         call this%append_memory(file, h5t_native_real, c_loc(short), size(values), error)
      else
         allocate (copy(size(values)), stat=status)
         if (out_of_memory(status, file, this%name, error)) return
         copy = values
         call this%append_memory(file, h5t_native_double, c_loc(copy), size(values), error)
      end if
   end subroutine append_reals

   subroutine append_real_rows(this, file, values, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> (component, row); components of the series that are not given are zero
      real(wp), intent(in) :: values(:, :)
      character(len=:), allocatable, intent(out) :: error
      real(wp), allocatable, target :: copy(:, :)
      real(real32), allocatable, target :: short(:, :)
      integer :: n, given, status
      n = size(values, 2)
      given = min(size(values, 1), this%components)
      if (this%element == real_32) then
         allocate (short(this%components, n), stat=status)
         if (out_of_memory(status, file, this%name, error)) return
         short(given + 1:, :) = 0
         short(:given, :) = to_single(values(:given, :))
         call this%append_memory(file, h5t_native_real, c_loc(short), n, error)
      else
         allocate (copy(this%components, n), stat=status)
         if (out_of_memory(status, file, this%name, error)) return
         copy(given + 1:, :) = 0
         copy(:given, :) = values(:given, :)
         call this%append_memory(file, h5t_native_double, c_loc(copy), n, error)
      end if
   end subroutine append_real_rows

   !> Nearest single precision number; what is too large for one becomes the largest one (a diverged run must still be written).
   elemental real(real32) function to_single(value)
      real(wp), intent(in) :: value
      real(wp), parameter :: largest = real(huge(1.0_real32), wp)
      if (abs(value) > largest) then
         to_single = real(sign(largest, value), real32)
      else
         to_single = real(value, real32)
      end if
   end function to_single

   subroutine append_integers(this, file, values, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> one value a row
      integer, intent(in) :: values(:)
      character(len=:), allocatable, intent(out) :: error
      integer, allocatable, target :: copy(:)
      integer :: status
      allocate (copy(size(values)), stat=status)
      if (out_of_memory(status, file, this%name, error)) return
      copy = values
      call this%append_memory(file, h5t_native_integer, c_loc(copy), size(values), error)
   end subroutine append_integers

   subroutine append_integer_rows(this, file, values, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> (component, row), all components of the series
      integer, intent(in) :: values(:, :)
      character(len=:), allocatable, intent(out) :: error
      integer, allocatable, target :: copy(:, :)
      integer :: status
      allocate (copy(size(values, 1), size(values, 2)), stat=status)
      if (out_of_memory(status, file, this%name, error)) return
      copy = values
      call this%append_memory(file, h5t_native_integer, c_loc(copy), size(values, 2), error)
   end subroutine append_integer_rows

   subroutine append_longs(this, file, values, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> one component after the other, row by row
      integer(i8), intent(in) :: values(:)
      character(len=:), allocatable, intent(out) :: error
      integer(i8), allocatable, target :: copy(:)
      integer :: status
      allocate (copy(size(values)), stat=status)
      if (out_of_memory(status, file, this%name, error)) return
      copy = values
      call this%append_memory(file, h5kind_to_type(i8, h5_integer_kind), c_loc(copy), &
                              size(values)/max(1, this%components), error)
   end subroutine append_longs

   subroutine append_bytes(this, file, values, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> one value a row
      integer(i1), intent(in) :: values(:)
      character(len=:), allocatable, intent(out) :: error
      integer(i1), allocatable, target :: copy(:)
      integer :: status
      allocate (copy(size(values)), stat=status)
      if (out_of_memory(status, file, this%name, error)) return
      copy = values
      call this%append_memory(file, h5kind_to_type(i1, h5_integer_kind), c_loc(copy), size(values), error)
   end subroutine append_bytes

   subroutine append_texts(this, file, values, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      !> one text a row; cut to the series' length, trailing blanks become its padding
      character(len=*), intent(in) :: values(:)
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable, target :: block
      integer(hid_t) :: memory_type
      integer :: i, n, first, status
      allocate (character(len=this%text_length*size(values)) :: block)
      do i = 1, size(values)
         n = min(len_trim(values(i)), this%text_length)
         first = (i - 1)*this%text_length
         block(first + 1:first + n) = values(i) (:n)
         block(first + n + 1:first + this%text_length) = repeat(achar(0), this%text_length - n)
      end do
      call stored_type(text_series, this%text_length, memory_type)
      call this%append_memory(file, memory_type, c_loc(block), size(values), error)
      call h5tclose_f(memory_type, status)
   end subroutine append_texts

   !> Lengthen the dataset by n rows and fill them. In SWMR mode it is flushed as well: so the rows are complete on disk before the
   !> file's own flush tells of them.
   subroutine append_memory(this, file, memory_type, values, n, error)
      class(hdf5_series_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      integer(hid_t), intent(in) :: memory_type
      !> where the rows are, contiguous
      type(c_ptr), intent(in) :: values
      !> number of rows
      integer, intent(in) :: n
      character(len=:), allocatable, intent(out) :: error
      integer(hsize_t) :: extent(2), start(2), count(2)
      integer(hid_t) :: file_space, memory_space
      integer :: rank, status, ignored
      if (n == 0) return
      rank = merge(1, 2, this%components == 0)
      start = 0; start(rank) = this%rows
      count(1) = this%components; count(rank) = n
      extent(1) = this%components; extent(rank) = this%rows + n
      call h5dset_extent_f(this%id, extent(:rank), status)
      call hdf5_failure(status, file%path, 'lengthen the dataset '//this%name, error)
      if (allocated(error)) return
      call h5dget_space_f(this%id, file_space, ignored)
      call h5sselect_hyperslab_f(file_space, h5s_select_set_f, start(:rank), count(:rank), ignored)
      call h5screate_simple_f(rank, count(:rank), memory_space, ignored)
      call h5dwrite_f(this%id, memory_type, values, status, memory_space, file_space)
      call hdf5_failure(status, file%path, 'write the dataset '//this%name, error)
      call h5sclose_f(memory_space, ignored)
      call h5sclose_f(file_space, ignored)
      if (allocated(error)) return
      this%rows = this%rows + n
      if (file%swmr .and. .not. this%held) call hdf5_failure(int(c_dataset_flush(int(this%id, c_int64_t))), file%path, &
                                       'write the dataset '//this%name, error)
   end subroutine append_memory

   !> True, with an error text, if an allocation failed.
   logical function out_of_memory(status, file, name, error)
      !> stat= of the allocation
      integer, intent(in) :: status
      type(hdf5_file_t), intent(in) :: file
      !> the dataset it was for
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: error
      out_of_memory = status /= 0
      if (out_of_memory) error = file%path//': cannot write the dataset '//name//': no memory for a copy of it'
   end function out_of_memory
end module rf_hdf5_series
