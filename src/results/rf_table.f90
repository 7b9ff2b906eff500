!> History and events: one table, written row by row to a CSV file and to growing datasets of an HDF5 file.
!>
!> Order of calls: `create` (makes the CSV file and, in the HDF5 file, GROUP/COLUMN for each column); after the HDF5 file's SWMR
!> mode has started `start`; then per row `put` for each column in turn and `end_row`; at last `close`. The HDF5 file is the
!> caller's.
module rf_table
   use rf_kinds, only: wp, i8
   use rf_archive, only: archive_t
   use rf_ascii, only: csv_t
   use rf_hdf5, only: hdf5_file_t
   use rf_hdf5_series, only: hdf5_series_t, real_64, integer_64, text_series
   implicit none
   private
   public :: column

   !> What a column holds.
   integer, parameter, public :: column_integer = integer_64, column_real = real_64, column_text = text_series
   !> rows of a column that are stored as one piece
   integer, parameter :: chunk_rows = 256
   !> longest text of a text column
   integer, parameter :: text_length = 16

   type, public :: column_t
      character(len=:), allocatable :: name
      !> column_integer, column_real or column_text
      integer :: kind = column_real
   end type column_t

   !> one value of the present row
   type :: entry_t
      integer :: integer_value = 0
      real(wp) :: real_value = 0
      character(len=text_length) :: text_value = ''
   end type entry_t

   type, public :: table_t
      type(csv_t), private :: csv
      type(hdf5_series_t), allocatable, private :: series(:)
      type(entry_t), allocatable, private :: row(:)
      !> values put into the present row
      integer, private :: filled = 0
      !> group of the datasets, for error texts
      character(len=:), allocatable, private :: group
      character(len=:), allocatable, private :: failure
      !> rows that are finished
      integer(i8), private :: rows = 0
   contains
      procedure :: create
      procedure :: exchange
      procedure :: go_on, look_at_text
      procedure :: start
      procedure, private :: put_integer, put_real, put_text
      !> give the next column its value; an integer may go into a column of reals
      generic :: put => put_integer, put_real, put_text
      procedure :: end_row
      procedure :: close => close_table
      procedure :: discard, mend, row_count, is_sound
   end type table_t

contains

   !> Describe a column.
   pure function column(name, kind) result(described)
      !> dataset name and CSV header
      character(len=*), intent(in) :: name
      !> column_real (default), column_integer or column_text
      integer, intent(in), optional :: kind
      type(column_t) :: described
      described%name = name
      if (present(kind)) described%kind = kind
   end function column

   !> Make the CSV file and the datasets.
   subroutine create(this, csv_path, file, group, columns, error)
      class(table_t), intent(out) :: this
      !> the CSV file; an existing one is replaced
      character(len=*), intent(in) :: csv_path
      !> open HDF5 file, not yet in SWMR mode
      type(hdf5_file_t), intent(in) :: file
      !> group to make, such as /rfem/history; the one it lies in exists
      character(len=*), intent(in) :: group
      type(column_t), intent(in) :: columns(:)
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      call this%csv%create(csv_path, names(columns), error)
      if (.not. allocated(error)) call file%add_group(group, error)
      if (allocated(error)) return
      call describe(this, group, columns)
      do i = 1, size(columns)
         call this%series(i)%create(file, chunk_rows, .false., error)
         if (allocated(error)) return
      end do
   end subroutine create

   !> Names and kinds of the datasets.
   subroutine describe(this, group, columns)
      type(table_t), intent(inout) :: this
      character(len=*), intent(in) :: group
      type(column_t), intent(in) :: columns(:)
      integer :: i
      this%group = group
      if (allocated(this%series)) deallocate (this%series, this%row)
      allocate (this%series(size(columns)), this%row(size(columns)))
      do i = 1, size(columns)
         this%series(i)%name = group//'/'//columns(i)%name
         this%series(i)%element = columns(i)%kind
         this%series(i)%text_length = text_length
         this%series(i)%held = .true.
      end do
   end subroutine describe

   !> To or from a checkpoint: how many rows there are. (Derived: series and group follow from the columns, row, filled are empty
   !> between two rows; failure ends a run.)
   subroutine exchange(this, archive)
      class(table_t), intent(inout) :: this
      class(archive_t), intent(inout) :: archive
      call archive%exchange('rows', this%rows)
      call archive%enter('csv')
      call this%csv%exchange(archive)
      call archive%leave()
   end subroutine exchange

   !> Look whether the run can go on with the CSV file, which becomes this process's alone.
   subroutine look_at_text(this, csv_path, error)
      class(table_t), intent(inout) :: this
      character(len=*), intent(in) :: csv_path
      character(len=:), allocatable, intent(out) :: error
      call this%csv%go_on(csv_path, .true., error)
   end subroutine look_at_text

   !> Go on with the files of a checkpoint; `start` follows.
   subroutine go_on(this, csv_path, file, group, columns, look_only, error)
      class(table_t), intent(inout) :: this
      !> as of `create`
      character(len=*), intent(in) :: csv_path
      !> open, not in SWMR mode
      type(hdf5_file_t), intent(in) :: file
      !> as of `create`
      character(len=*), intent(in) :: group
      type(column_t), intent(in) :: columns(:)
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      call describe(this, group, columns)
      call this%csv%go_on(csv_path, look_only, error)
      do i = 1, size(columns)
         if (.not. allocated(error)) call this%series(i)%cut(file, this%rows, look_only, error)
      end do
   end subroutine go_on

   !> The names as an array of equal length.
   pure function names(columns) result(list)
      type(column_t), intent(in) :: columns(:)
      character(len=:), allocatable :: list(:)
      integer :: i, longest
      longest = 1
      do i = 1, size(columns)
         longest = max(longest, len(columns(i)%name))
      end do
      allocate (character(len=longest) :: list(size(columns)))
      do i = 1, size(columns)
         list(i) = columns(i)%name
      end do
   end function names

   !> Open the datasets, once the file is in SWMR mode (or will not be).
   subroutine start(this, file, error)
      class(table_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      do i = 1, size(this%series)
         call this%series(i)%open(file, error)
         if (allocated(error)) return
      end do
   end subroutine start

   subroutine put_integer(this, value)
      class(table_t), intent(inout) :: this
      integer, intent(in) :: value
      call next_column(this, [column_integer, column_real])
      if (allocated(this%failure)) return
      this%row(this%filled)%integer_value = value
      this%row(this%filled)%real_value = real(value, wp)
   end subroutine put_integer

   subroutine put_real(this, value)
      class(table_t), intent(inout) :: this
      real(wp), intent(in) :: value
      call next_column(this, [column_real])
      if (.not. allocated(this%failure)) this%row(this%filled)%real_value = value
   end subroutine put_real

   subroutine put_text(this, value)
      class(table_t), intent(inout) :: this
      !> at most 16 characters are kept
      character(len=*), intent(in) :: value
      call next_column(this, [column_text])
      if (.not. allocated(this%failure)) this%row(this%filled)%text_value = value
   end subroutine put_text

   !> Go on to the next column; a failure if there is none or its kind is another.
   subroutine next_column(this, kinds)
      class(table_t), intent(inout) :: this
      !> kinds that the value fits
      integer, intent(in) :: kinds(:)
      if (allocated(this%failure)) return
      if (this%filled == size(this%row)) then
         this%failure = this%group//': a row has more values than columns'
      else if (all(kinds /= this%series(this%filled + 1)%element)) then
         this%failure = this%series(this%filled + 1)%name//': a value of the wrong kind'
      else
         this%filled = this%filled + 1
      end if
   end subroutine next_column

   !> Write the row to both files.
   subroutine end_row(this, file, error)
      class(table_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      if (.not. allocated(this%failure) .and. this%filled < size(this%row)) &
         this%failure = this%group//': a row has fewer values than columns'
      if (allocated(this%failure)) error = this%failure
      if (allocated(error)) return
      do i = 1, size(this%row)
         select case (this%series(i)%element)
         case (column_integer); call this%csv%put(this%row(i)%integer_value)
         case (column_real); call this%csv%put(this%row(i)%real_value)
         case default; call this%csv%put(trim(this%row(i)%text_value))
         end select
      end do
      call this%csv%end_row(error)
      if (.not. allocated(error)) call append_row(this, file, error)
      this%filled = 0
      if (allocated(error)) then
         this%failure = error
      else
         this%rows = this%rows + 1
      end if
   end subroutine end_row

   !> Whether all rows could be written.
   pure logical function is_sound(this)
      class(table_t), intent(in) :: this
      is_sound = .not. allocated(this%failure)
   end function is_sound

   !> Rows that are finished.
   pure integer(i8) function row_count(this)
      class(table_t), intent(in) :: this
      row_count = this%rows
   end function row_count

   subroutine append_row(this, file, error)
      class(table_t), intent(inout) :: this
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      do i = 1, size(this%row)
         associate (column_series => this%series(i), value => this%row(i))
            select case (column_series%element)
            case (column_integer); call column_series%append(file, [value%integer_value], error)
            case (column_real); call column_series%append(file, [value%real_value], error)
            case default; call column_series%append(file, [value%text_value], error)
            end select
         end associate
         if (allocated(error)) return
      end do
      if (file%swmr) call file%flush(error)
   end subroutine append_row

   !> Close the CSV file and the datasets, not the HDF5 file.
   subroutine close_table(this, error)
      class(table_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      if (allocated(this%series)) then
         do i = 1, size(this%series)
            call this%series(i)%close()
         end do
      end if
      call this%csv%close(error)
      if (allocated(this%failure)) error = this%failure
   end subroutine close_table

   !> After `discard`: cut the datasets to the finished rows, so that no column is longer than another.
   subroutine mend(this, file, error)
      class(table_t), intent(inout) :: this
      !> open, not in SWMR mode
      type(hdf5_file_t), intent(in) :: file
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      do i = 1, size(this%series)
         call this%series(i)%cut(file, this%rows, .false., error)
         call this%series(i)%close()
         if (allocated(error)) return
      end do
   end subroutine mend

   !> Close, and delete the CSV file.
   subroutine discard(this, keep)
      class(table_t), intent(inout) :: this
      !> leave what is finished instead of deleting it (default: no)
      logical, intent(in), optional :: keep
      integer :: i
      if (allocated(this%series)) then
         do i = 1, size(this%series)
            call this%series(i)%close()
         end do
      end if
      call this%csv%discard(keep)
   end subroutine discard
end module rf_table
