!> Tables as text: comma-separated ones (history, events), and JOB.dat in CalculiX's layout.
!>
!> CalculiX's layout was taken from the output of ccx 2.20 on a deck with NODE PRINT and EL PRINT: a blank line, a header, a blank
!> line, then i10 for an id, i3 for an integration point, and 13 columns of 7 significant digits a value.
module rf_ascii
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_text_file, only: text_file_t
   use rf_text, only: to_text
   implicit none
   private

   !> below it an exponent has three digits, for which the columns have no room: written as zero
   real(wp), parameter :: smallest_in_columns = 1.0e-99_wp
   !> the quantities of JOB.dat as its headers name them
   character(len=*), parameter, public :: dat_displacements = 'displacements (vx,vy,vz)', dat_forces = 'forces (fx,fy,fz)', &
                            dat_total_force = 'total force (fx,fy,fz)', &
                            dat_stresses = 'stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz)', &
                            dat_strains = 'strains (elem, integ.pnt.,exx,eyy,ezz,exy,exz,eyz)'

   !> A comma-separated table: one header line, then a row at a time, each complete on disk before the next.
   type, public :: csv_t
      type(text_file_t), private :: file
      !> the row that is being put together
      character(len=:), allocatable, private :: row
   contains
      procedure :: create => create_csv
      procedure :: exchange => exchange_csv
      procedure :: go_on => go_on_csv
      procedure, private :: put_integer, put_real, put_text
      !> add a value to the row
      generic :: put => put_integer, put_real, put_text
      procedure :: end_row
      procedure :: close => close_csv
      procedure :: discard => discard_csv
   end type csv_t

   !> JOB.dat: tables one after the other.
   type, public :: dat_t
      type(text_file_t), private :: file
   contains
      procedure :: create => create_dat
      procedure :: exchange => exchange_dat
      procedure :: go_on => go_on_dat
      procedure :: node_table
      procedure :: total_table
      procedure :: element_table
      procedure :: close => close_dat
      procedure :: discard => discard_dat
      procedure :: is_empty => is_empty_dat
      procedure, private :: header
   end type dat_t

contains

   !> Make the file (an existing one is replaced) with its header line.
   subroutine create_csv(this, path, columns, error)
      class(csv_t), intent(out) :: this
      character(len=*), intent(in) :: path
      !> names of the columns; trailing blanks do not count
      character(len=*), intent(in) :: columns(:)
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      call this%file%create(path, error)
      if (allocated(error)) return
      this%row = ''
      do i = 1, size(columns)
         call this%put(trim(columns(i)))
      end do
      call this%end_row(error)
   end subroutine create_csv

   !> To or from a checkpoint. (Derived: row is empty between two rows.)
   subroutine exchange_csv(this, archive)
      class(csv_t), intent(inout) :: this
      class(archive_t), intent(inout) :: archive
      call this%file%exchange(archive)
   end subroutine exchange_csv

   !> Go on with the file of a checkpoint.
   subroutine go_on_csv(this, path, look_only, error)
      class(csv_t), intent(inout) :: this
      character(len=*), intent(in) :: path
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      this%row = ''
      call this%file%go_on(path, look_only, error)
   end subroutine go_on_csv

   subroutine put_integer(this, value)
      class(csv_t), intent(inout) :: this
      integer, intent(in) :: value
      this%row = this%row//','//to_text(value)
   end subroutine put_integer

   subroutine put_real(this, value)
      class(csv_t), intent(inout) :: this
      real(wp), intent(in) :: value
      this%row = this%row//','//to_text(value)
   end subroutine put_real

   subroutine put_text(this, value)
      class(csv_t), intent(inout) :: this
      !> quoted if it holds a comma or a quotation mark
      character(len=*), intent(in) :: value
      character(len=:), allocatable :: quoted
      integer :: i
      if (scan(value, ',"'//new_line('a')) == 0) then
         this%row = this%row//','//value
         return
      end if
      quoted = ''
      do i = 1, len(value)
         quoted = quoted//repeat(value(i:i), merge(2, 1, value(i:i) == '"'))
      end do
      this%row = this%row//',"'//quoted//'"'
   end subroutine put_text

   !> Write the row.
   subroutine end_row(this, error)
      class(csv_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      call this%file%put_line(this%row(2:))
      call this%file%flush(error)
      this%row = ''
   end subroutine end_row

   subroutine close_csv(this, error)
      class(csv_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      call this%file%close(error)
   end subroutine close_csv

   !> Close and delete.
   subroutine discard_csv(this, keep)
      class(csv_t), intent(inout) :: this
      !> leave what is finished instead of deleting it (default: no)
      logical, intent(in), optional :: keep
      call this%file%discard(keep)
   end subroutine discard_csv

   !> Make JOB.dat; an existing one is replaced.
   subroutine create_dat(this, path, error)
      class(dat_t), intent(out) :: this
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      call this%file%create(path, error)
   end subroutine create_dat

   !> To or from a checkpoint.
   subroutine exchange_dat(this, archive)
      class(dat_t), intent(inout) :: this
      class(archive_t), intent(inout) :: archive
      call this%file%exchange(archive)
   end subroutine exchange_dat

   !> Go on with the file of a checkpoint.
   subroutine go_on_dat(this, path, look_only, error)
      class(dat_t), intent(inout) :: this
      character(len=*), intent(in) :: path
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      call this%file%go_on(path, look_only, error)
   end subroutine go_on_dat

   subroutine header(this, what, set, time)
      class(dat_t), intent(inout) :: this
      !> one of the dat_ names
      character(len=*), intent(in) :: what
      character(len=*), intent(in) :: set
      real(wp), intent(in) :: time
      character(len=14) :: number
      ! one digit less in front of the point than elsewhere: that is how ccx writes its times
      write (number, '(e14.7)') time
      call this%file%put_line('')
      call this%file%put_line(' '//what//' for set '//trim(set)//' and time '//number)
      call this%file%put_line('')
   end subroutine header

   !> Write a table of node values: id and three components a line.
   subroutine node_table(this, what, set, time, ids, values, error)
      class(dat_t), intent(inout) :: this
      !> dat_displacements or dat_forces
      character(len=*), intent(in) :: what
      !> name of the node set
      character(len=*), intent(in) :: set
      !> total time [time]
      real(wp), intent(in) :: time
      !> node ids of the deck
      integer, intent(in) :: ids(:)
      !> (2 or 3, nodes); a third component that is not given is zero
      real(wp), intent(in) :: values(:, :)
      character(len=:), allocatable, intent(out) :: error
      character(len=52) :: line
      integer :: i
      call this%header(what, set, time)
      do i = 1, size(ids)
         write (line, '(i10, 3(1x, es13.6))') ids(i), with_third(values(:, i))
         call this%file%put_line(line)
      end do
      call this%file%flush(error)
   end subroutine node_table

   !> Write the sum of the reaction forces over a set.
   subroutine total_table(this, set, time, total, error)
      class(dat_t), intent(inout) :: this
      !> name of the node set
      character(len=*), intent(in) :: set
      !> total time [time]
      real(wp), intent(in) :: time
      !> sum of the forces [force], 2 or 3 components
      real(wp), intent(in) :: total(:)
      character(len=:), allocatable, intent(out) :: error
      character(len=48) :: line
      call this%header(dat_total_force, set, time)
      write (line, '(6x, 3(1x, es13.6))') with_third(total)
      call this%file%put_line(line)
      call this%file%flush(error)
   end subroutine total_table

   !> Write a table of element values: id, integration point (1: they are constant) and six components a line.
   subroutine element_table(this, what, set, time, ids, values, error)
      class(dat_t), intent(inout) :: this
      !> dat_stresses or dat_strains
      character(len=*), intent(in) :: what
      !> name of the element set
      character(len=*), intent(in) :: set
      !> total time [time]
      real(wp), intent(in) :: time
      !> element ids of the deck
      integer, intent(in) :: ids(:)
      !> (6, elements): XX YY ZZ XY YZ XZ as in the frames; shear strains are the tensor's (half the engineering ones), as ccx has
      !> them
      real(wp), intent(in) :: values(:, :)
      character(len=:), allocatable, intent(out) :: error
      !> ccx writes XX YY ZZ XY XZ YZ
      integer, parameter :: order(6) = [1, 2, 3, 4, 6, 5]
      character(len=98) :: line
      integer :: i
      call this%header(what, set, time)
      do i = 1, size(ids)
         write (line, '(i10, 1x, i3, 6(1x, es13.6))') ids(i), 1, in_columns(values(order, i))
         call this%file%put_line(line)
      end do
      call this%file%flush(error)
   end subroutine element_table

   !> Three components ready to be written.
   pure function with_third(values) result(three)
      !> 2 or 3 components
      real(wp), intent(in) :: values(:)
      real(wp) :: three(3)
      three = 0
      three(:size(values)) = in_columns(values)
   end function with_third

   elemental real(wp) function in_columns(value)
      real(wp), intent(in) :: value
      in_columns = value
      if (abs(value) < smallest_in_columns) in_columns = 0
   end function in_columns

   subroutine close_dat(this, error)
      class(dat_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      call this%file%close(error)
   end subroutine close_dat

   !> Close and delete.
   subroutine discard_dat(this, keep)
      class(dat_t), intent(inout) :: this
      !> leave what is finished instead of deleting it (default: no)
      logical, intent(in), optional :: keep
      call this%file%discard(keep)
   end subroutine discard_dat

   !> Whether no table is finished.
   pure logical function is_empty_dat(this)
      class(dat_t), intent(in) :: this
      is_empty_dat = this%file%is_empty()
   end function is_empty_dat
end module rf_ascii
