!> Frames of a run as VTKHDF 2.0, temporal UnstructuredGrid: ParaView (5.12 or newer), VTK and h5py open the file as it is.
!>
!> Order of calls: `create`; `add_geometry` whenever nodes or cells have changed (it is stored once while they have not); per frame
!> `begin_frame`, `point_data`/`cell_data` for the fields, `end_frame`; at last `close`. A field that was declared is in every
!> frame; one that is not given in a frame keeps its values as long as the geometry is the same (ids, materials). An error is
!> remembered, the calls after it do nothing, and `end_frame` and `close` hand it back.
!>
!> The file is in HDF5's single-writer-multiple-reader mode from its first geometry on: whatever happens to the program, finished
!> frames can be read (h5py with swmr=True, others after `h5clear -s --increment=0 FILE`). A file closed normally is an ordinary
!> one.
module rf_vtkhdf
   use, intrinsic :: iso_fortran_env, only: real32
   use rf_kinds, only: wp, i1, i8
   use rf_archive, only: archive_t
   use rf_hdf5, only: hdf5_file_t
   use rf_system, only: path_exists
   use rf_hdf5_series, only: hdf5_series_t, real_64, real_32, integer_64, integer_32, byte_8
   implicit none
   private
   public :: vtkhdf_field
   public :: real_64, real_32, integer_32

   !> VTK's numbers of the cells that are written
   integer, parameter, public :: vtk_line = 3, vtk_triangle = 5
   !> the k-th frame of one time is set off by k times this part of it, so that readers keep the frames apart
   real(wp), parameter :: frame_shift = 1.0e-9_wp
   !> the same at time 0, where a part of it is nothing: the smallest single precision number, as some readers use single precision
   real(wp), parameter :: shift_at_zero = real(tiny(1.0_real32), wp)
   !> bounds of the number of rows that are stored and compressed as one piece. Pieces about as large as a frame waste least, but
   !> large ones do not fit HDF5's cache of 1 MB
   integer, parameter :: smallest_chunk = 512, largest_chunk = 16384
   !> the same for series that get one row a frame
   integer, parameter :: frame_chunk = 256

   !> the series that describe geometries and frames, as positions in `layout`
   integer, parameter :: number_of_points = 1, number_of_cells = 2, number_of_ids = 3, points = 4, connectivity = 5, &
      offsets = 6, types = 7, part_offsets = 8, number_of_parts = 9, point_offsets = 10, cell_offsets = 11, &
      id_offsets = 12, kinds = 13, kind_offsets = 14, kind_sizes = 15, values = 16, layout_size = 16

   !> What a field is called and how it is stored.
   type, public :: vtkhdf_field_t
      character(len=:), allocatable :: name
      !> 1 scalar, 3 vector, 6 symmetric tensor (XX YY ZZ XY YZ XZ)
      integer :: components = 1
      !> real_32, real_64 or integer_32
      integer :: element = real_32
   end type vtkhdf_field_t

   !> A field and where its values of the present frame begin.
   type :: stored_field_t
      type(hdf5_series_t) :: values
      type(hdf5_series_t) :: offsets
      integer(i8) :: start = 0
      !> ordinal of the geometry these values belong to; 0: none yet
      integer :: geometry = 0
   end type stored_field_t

   !> A file of frames.
   type, public :: vtkhdf_file_t
      type(hdf5_file_t), private :: file
      type(hdf5_series_t), private :: layout(layout_size)
      type(stored_field_t), allocatable, private :: point_fields(:)
      type(stored_field_t), allocatable, private :: cell_fields(:)
      integer, private :: cell_type = vtk_triangle
      integer, private :: nodes_per_cell = 3
      !> datasets exist and SWMR mode is on
      logical, private :: started = .false.
      logical, private :: in_frame = .false.
      !> geometries written
      integer, private :: geometries = 0
      !> frames finished
      integer, private :: frames = 0
      !> points and cells of the present geometry
      integer, private :: n_points = 0, n_cells = 0
      !> where the present geometry begins
      integer(i8), private :: first_point = 0, first_cell = 0, first_id = 0
      !> time of the last frame as it was given and as it was written, and how many frames have had it
      real(wp), private :: time = -huge(1.0_wp), written_time = -huge(1.0_wp)
      integer, private :: frames_of_time = 0
      !> frame_kind of the present frame
      integer, private :: kind = 0
      !> the first error
      character(len=:), allocatable, private :: failure
      !> what a checkpoint knows: rows of the layout, of the fields' values and offsets; first row and geometry of the fields'
      !> last values (points' fields, then cells')
      integer(i8), allocatable, private :: kept_rows(:), kept_starts(:)
      integer, allocatable, private :: kept_geometries(:)
   contains
      procedure :: create
      procedure :: exchange
      procedure :: go_on
      procedure :: add_geometry
      procedure :: begin_frame
      procedure, private :: point_reals, point_rows, point_integers, cell_reals, cell_rows, cell_integers
      !> the values of a field at the points in the present frame: (points) or (component, points)
      generic :: point_data => point_reals, point_rows, point_integers
      !> the values of a field in the cells in the present frame: (cells) or (component, cells)
      generic :: cell_data => cell_reals, cell_rows, cell_integers
      procedure :: end_frame
      procedure :: close => close_file
      procedure :: discard
      procedure :: mend
      procedure :: frame_count
      procedure, private :: start, note
   end type vtkhdf_file_t

contains

   !> Describe a field.
   pure function vtkhdf_field(name, components, element) result(field)
      !> dataset name
      character(len=*), intent(in) :: name
      !> 1 scalar (default), 3 vector, 6 symmetric tensor
      integer, intent(in), optional :: components
      !> real_32 (default), real_64 or integer_32
      integer, intent(in), optional :: element
      type(vtkhdf_field_t) :: field
      field%name = name
      if (present(components)) field%components = components
      if (present(element)) field%element = element
   end function vtkhdf_field

   !> Make the file; an existing one is replaced.
   subroutine create(this, path, cell_type, point_fields, cell_fields, error)
      class(vtkhdf_file_t), intent(out) :: this
      character(len=*), intent(in) :: path
      !> vtk_triangle or vtk_line
      integer, intent(in) :: cell_type
      !> fields of every frame at the points
      type(vtkhdf_field_t), intent(in) :: point_fields(:)
      !> fields of every frame in the cells
      type(vtkhdf_field_t), intent(in) :: cell_fields(:)
      character(len=:), allocatable, intent(out) :: error
      character(len=*), parameter :: groups(9) = [character(len=31) :: '/VTKHDF', '/VTKHDF/PointData', '/VTKHDF/CellData', &
                             '/VTKHDF/FieldData', '/VTKHDF/Steps', '/VTKHDF/Steps/PointDataOffsets', &
                             '/VTKHDF/Steps/CellDataOffsets', '/VTKHDF/Steps/FieldDataOffsets', '/VTKHDF/Steps/FieldDataSizes']
      integer :: i
      this%cell_type = cell_type
      this%nodes_per_cell = merge(2, 3, cell_type == vtk_line)
      call describe_fields(point_fields, 'PointData', this%point_fields)
      call describe_fields(cell_fields, 'CellData', this%cell_fields)
      call this%file%create(path, error)
      do i = 1, size(groups)
         if (.not. allocated(error)) call this%file%add_group(trim(groups(i)), error)
      end do
      if (.not. allocated(error)) call this%file%set_attribute('/VTKHDF', 'Version', [2, 0], error)
      if (.not. allocated(error)) call this%file%set_attribute('/VTKHDF', 'Type', 'UnstructuredGrid', error)
      if (.not. allocated(error)) call this%file%set_attribute('/VTKHDF/Steps', 'NSteps', 0, error)
      if (allocated(error)) this%failure = error
   end subroutine create

   !> To or from a checkpoint. (Derived: file, layout, point_fields, cell_fields, cell_type, nodes_per_cell follow from what is
   !> written, and are kept as rows, starts and geometries; in_frame is false between frames; failure ends a run.)
   subroutine exchange(this, archive)
      class(vtkhdf_file_t), intent(inout) :: this
      class(archive_t), intent(inout) :: archive
      if (.not. archive%reading) call keep_rows(this, archive)
      call archive%exchange('started', this%started)
      call archive%exchange('geometries', this%geometries)
      call archive%exchange('frames', this%frames)
      call archive%exchange('n_points', this%n_points)
      call archive%exchange('n_cells', this%n_cells)
      call archive%exchange('first_point', this%first_point)
      call archive%exchange('first_cell', this%first_cell)
      call archive%exchange('first_id', this%first_id)
      call archive%exchange('time', this%time)
      call archive%exchange('written_time', this%written_time)
      call archive%exchange('frames_of_time', this%frames_of_time)
      call archive%exchange('kind', this%kind)
      call archive%exchange('rows', this%kept_rows)
      call archive%exchange('starts', this%kept_starts)
      call archive%exchange('geometry_of_fields', this%kept_geometries)
   end subroutine exchange

   !> Note how long everything is, once it lies on the disk.
   subroutine keep_rows(this, archive)
      class(vtkhdf_file_t), intent(inout) :: this
      class(archive_t), intent(inout) :: archive
      character(len=:), allocatable :: error
      if (.not. allocated(this%point_fields)) return
      call this%file%sync(error)
      if (allocated(error)) call archive%fail(error)
      this%kept_rows = [this%layout%rows, this%point_fields%values%rows, this%point_fields%offsets%rows, &
                        this%cell_fields%values%rows, this%cell_fields%offsets%rows]
      this%kept_starts = [this%point_fields%start, this%cell_fields%start]
      this%kept_geometries = [this%point_fields%geometry, this%cell_fields%geometry]
   end subroutine keep_rows

   !> Go on with the file of a checkpoint: what was written after it is cut off. One that had no frame yet is made anew, for its
   !> datasets suit the first geometry.
   subroutine go_on(this, path, cell_type, point_fields, cell_fields, look_only, error)
      class(vtkhdf_file_t), intent(inout) :: this
      !> as of `create`
      character(len=*), intent(in) :: path
      integer, intent(in) :: cell_type
      type(vtkhdf_field_t), intent(in) :: point_fields(:), cell_fields(:)
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable :: problem
      if (.not. this%started) then
         if (.not. path_exists(path)) error = path//': is missing; the run cannot go on without it'
         if (.not. (look_only .or. allocated(error))) call this%create(path, cell_type, point_fields, cell_fields, error)
         return
      end if
      this%cell_type = cell_type
      this%nodes_per_cell = merge(2, 3, cell_type == vtk_line)
      call describe_fields(point_fields, 'PointData', this%point_fields)
      call describe_fields(cell_fields, 'CellData', this%cell_fields)
      call describe_layout(this%layout)
      call this%file%reopen(path, error, look_only)
      if (.not. allocated(error)) call cut_all(this, look_only, error)
      if (look_only .or. allocated(error)) then
         call this%file%close(problem)
         return
      end if
      call this%file%set_attribute('/VTKHDF/Steps', 'NSteps', this%frames, error)
      if (.not. allocated(error)) call this%file%start_swmr(error)
      if (.not. allocated(error)) call open_all(this, error)
   end subroutine go_on

   !> Cut every series to the rows that are known.
   subroutine cut_all(this, look_only, error)
      class(vtkhdf_file_t), intent(inout) :: this
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      integer :: i, n, m
      n = size(this%point_fields)
      m = size(this%cell_fields)
      i = 0
      if (allocated(this%kept_rows)) i = size(this%kept_rows)
      if (i /= layout_size + 2*(n + m)) error = this%file%path//': has other fields than the checkpoint'
      do i = 1, layout_size
         if (.not. allocated(error)) call this%layout(i)%cut(this%file, this%kept_rows(i), look_only, error)
      end do
      if (.not. allocated(error)) call cut_fields(this%point_fields, layout_size, 0)
      if (.not. allocated(error)) call cut_fields(this%cell_fields, layout_size + 2*n, n)

   contains

      subroutine cut_fields(fields, first, before)
         type(stored_field_t), intent(inout) :: fields(:)
         !> places in the lists before theirs
         integer, intent(in) :: first, before
         integer :: k
         do k = 1, size(fields)
            fields(k)%start = this%kept_starts(before + k)
            fields(k)%geometry = this%kept_geometries(before + k)
            call fields(k)%values%cut(this%file, this%kept_rows(first + k), look_only, error)
            if (allocated(error)) return
            call fields(k)%offsets%cut(this%file, this%kept_rows(first + size(fields) + k), look_only, error)
            if (allocated(error)) return
         end do
      end subroutine cut_fields

   end subroutine cut_all

   subroutine describe_fields(fields, group, stored)
      type(vtkhdf_field_t), intent(in) :: fields(:)
      !> PointData or CellData
      character(len=*), intent(in) :: group
      type(stored_field_t), allocatable, intent(out) :: stored(:)
      integer :: i
      allocate (stored(size(fields)))
      do i = 1, size(fields)
         stored(i)%values%name = '/VTKHDF/'//group//'/'//fields(i)%name
         stored(i)%values%element = fields(i)%element
         stored(i)%values%components = merge(0, fields(i)%components, fields(i)%components == 1)
         stored(i)%offsets%name = '/VTKHDF/Steps/'//group//'Offsets/'//fields(i)%name
         stored(i)%offsets%element = integer_64
         stored(i)%offsets%held = .true.
      end do
   end subroutine describe_fields

   !> What the layout consists of: name, element and components of each series.
   subroutine describe_layout(layout)
      type(hdf5_series_t), intent(inout) :: layout(:)
      character(len=*), parameter :: names(layout_size) = [character(len=33) :: 'NumberOfPoints', 'NumberOfCells', &
                            'NumberOfConnectivityIds', 'Points', 'Connectivity', 'Offsets', 'Types', &
                            'Steps/PartOffsets', 'Steps/NumberOfParts', 'Steps/PointOffsets', 'Steps/CellOffsets', &
                            'Steps/ConnectivityIdOffsets', 'FieldData/frame_kind', 'Steps/FieldDataOffsets/frame_kind', &
                            'Steps/FieldDataSizes/frame_kind', 'Steps/Values']
      integer :: i
      do i = 1, layout_size
         layout(i)%name = '/VTKHDF/'//trim(names(i))
      end do
      layout%element = integer_64
      layout(part_offsets:)%held = .true.
      layout(points)%element = real_64
      layout(values)%element = real_64
      layout(types)%element = byte_8
      layout(kinds)%element = integer_32
      layout(points)%components = 3
      layout(cell_offsets)%components = 1
      layout(id_offsets)%components = 1
      layout(kind_sizes)%components = 2
   end subroutine describe_layout

   !> Make all datasets, in pieces that suit the first geometry, and start SWMR mode.
   subroutine start(this, n_points, n_cells)
      class(vtkhdf_file_t), intent(inout) :: this
      integer, intent(in) :: n_points
      integer, intent(in) :: n_cells
      character(len=:), allocatable :: error
      integer :: i, n
      call describe_layout(this%layout)
      do i = 1, layout_size
         select case (i)
         case (points); n = n_points
         case (connectivity); n = n_cells*this%nodes_per_cell
         case (offsets, types); n = n_cells
         case default; n = 0
         end select
         if (i >= points .and. i <= types) then
            call this%layout(i)%create(this%file, chunk_rows(n), .true., error)
         else
            call this%layout(i)%create(this%file, frame_chunk, .false., error)
         end if
         if (this%note(error)) return
      end do
      call create_fields(this%point_fields, this%file, chunk_rows(n_points), error)
      if (this%note(error)) return
      call create_fields(this%cell_fields, this%file, chunk_rows(n_cells), error)
      if (this%note(error)) return
      call this%file%start_swmr(error)
      if (this%note(error)) return
      call open_all(this, error)
      this%started = .not. this%note(error)
   end subroutine start

   pure integer function chunk_rows(n)
      !> rows of a frame
      integer, intent(in) :: n
      chunk_rows = max(smallest_chunk, min(largest_chunk, n))
   end function chunk_rows

   subroutine create_fields(fields, file, chunk, error)
      type(stored_field_t), intent(inout) :: fields(:)
      type(hdf5_file_t), intent(in) :: file
      !> rows that are stored as one piece
      integer, intent(in) :: chunk
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      do i = 1, size(fields)
         call fields(i)%values%create(file, chunk, .true., error)
         if (allocated(error)) return
         call fields(i)%offsets%create(file, frame_chunk, .false., error)
         if (allocated(error)) return
      end do
   end subroutine create_fields

   subroutine open_all(this, error)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      do i = 1, layout_size
         call this%layout(i)%open(this%file, error)
         if (allocated(error)) return
      end do
      do i = 1, size(this%point_fields)
         call this%point_fields(i)%values%open(this%file, error)
         if (.not. allocated(error)) call this%point_fields(i)%offsets%open(this%file, error)
         if (allocated(error)) return
      end do
      do i = 1, size(this%cell_fields)
         call this%cell_fields(i)%values%open(this%file, error)
         if (.not. allocated(error)) call this%cell_fields(i)%offsets%open(this%file, error)
         if (allocated(error)) return
      end do
   end subroutine open_all

   !> Keep an error; true if there is one now or was one before.
   logical function note(this, error)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(in) :: error
      if (allocated(error) .and. .not. allocated(this%failure)) this%failure = error
      note = allocated(this%failure)
   end function note

   !> Store points and cells; the frames from here on use them. Both may be empty.
   subroutine add_geometry(this, coordinates, cells)
      class(vtkhdf_file_t), intent(inout) :: this
      !> reference coordinates [length], (2 or 3, points)
      real(wp), intent(in) :: coordinates(:, :)
      !> points of each cell, from 1, (nodes per cell, cells)
      integer, intent(in) :: cells(:, :)
      character(len=:), allocatable :: error
      if (allocated(this%failure)) return
      if (.not. this%started) call this%start(size(coordinates, 2), size(cells, 2))
      if (allocated(this%failure)) return
      this%n_points = size(coordinates, 2)
      this%n_cells = size(cells, 2)
      this%geometries = this%geometries + 1
      this%first_point = this%layout(points)%rows
      this%first_cell = this%layout(types)%rows
      this%first_id = this%layout(connectivity)%rows
      call write_cells(this, cells, error)
      if (.not. allocated(error)) call this%layout(points)%append(this%file, coordinates, error)
      if (.not. allocated(error)) call this%layout(number_of_points)%append(this%file, [this%n_points], error)
      if (.not. allocated(error)) call this%layout(number_of_cells)%append(this%file, [this%n_cells], error)
      if (.not. allocated(error)) call this%layout(number_of_ids)%append(this%file, [size(cells)], error)
      if (this%note(error)) return
   end subroutine add_geometry

   subroutine write_cells(this, cells, error)
      class(vtkhdf_file_t), intent(inout) :: this
      !> (nodes per cell, cells), from 1
      integer, intent(in) :: cells(:, :)
      character(len=:), allocatable, intent(out) :: error
      integer(i8), allocatable :: ids(:)
      integer(i1), allocatable :: kind(:)
      integer :: i, j, m, status
      m = this%nodes_per_cell
      allocate (ids(max(size(cells), this%n_cells + 1)), stat=status)
      if (status == 0) allocate (kind(this%n_cells), stat=status)
      if (status /= 0) then
         error = this%file%path//': no memory for a copy of the cells'
         return
      end if
      do i = 1, this%n_cells
         do j = 1, m
            ids((i - 1)*m + j) = cells(j, i) - 1
         end do
      end do
      call this%layout(connectivity)%append(this%file, ids(:size(cells)), error)
      if (allocated(error)) return
      do i = 0, this%n_cells
         ids(i + 1) = int(m, i8)*i
      end do
      call this%layout(offsets)%append(this%file, ids(:this%n_cells + 1), error)
      if (allocated(error)) return
      kind = int(this%cell_type, i1)
      call this%layout(types)%append(this%file, kind, error)
   end subroutine write_cells

   !> Begin a frame on the present geometry.
   subroutine begin_frame(this, time, kind)
      class(vtkhdf_file_t), intent(inout) :: this
      !> total time of the state [time]; not below that of the frame before
      real(wp), intent(in) :: time
      !> field data `frame_kind`: 0 start, 1 before the first event, 2 after an event, 3 nothing fails any more, 4 not converged
      integer, intent(in) :: kind
      character(len=:), allocatable :: error
      if (allocated(this%failure)) return
      if (this%geometries == 0 .or. this%in_frame) error = this%file%path//': a frame was begun out of turn'
      if (this%note(error)) return
      this%in_frame = .true.
      this%kind = kind
      this%frames_of_time = merge(this%frames_of_time + 1, 0, abs(time - this%time) <= 0.0_wp)
      this%time = time
      this%written_time = max(shifted_time(time, this%frames_of_time), nearest(this%written_time, 1.0_wp))
   end subroutine begin_frame

   !> Time as it is written.
   pure real(wp) function shifted_time(time, k)
      real(wp), intent(in) :: time
      !> frames of this time before this one
      integer, intent(in) :: k
      if (time > 0.0_wp .or. time < 0.0_wp) then
         shifted_time = time + abs(time)*k*frame_shift
      else
         shifted_time = k*shift_at_zero
      end if
   end function shifted_time

   subroutine point_reals(this, name, field_values)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=*), intent(in) :: name
      !> (points)
      real(wp), intent(in) :: field_values(:)
      character(len=:), allocatable :: error
      integer :: i
      call find_field(this, this%point_fields, name, size(field_values), this%n_points, i)
      if (i == 0) return
      call this%point_fields(i)%values%append(this%file, field_values, error)
      if (this%note(error)) return
   end subroutine point_reals

   subroutine point_rows(this, name, field_values)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=*), intent(in) :: name
      !> (component, points); components that are not given are zero
      real(wp), intent(in) :: field_values(:, :)
      character(len=:), allocatable :: error
      integer :: i
      call find_field(this, this%point_fields, name, size(field_values, 2), this%n_points, i)
      if (i == 0) return
      call this%point_fields(i)%values%append(this%file, field_values, error)
      if (this%note(error)) return
   end subroutine point_rows

   subroutine point_integers(this, name, field_values)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=*), intent(in) :: name
      !> (points)
      integer, intent(in) :: field_values(:)
      character(len=:), allocatable :: error
      integer :: i
      call find_field(this, this%point_fields, name, size(field_values), this%n_points, i)
      if (i == 0) return
      call this%point_fields(i)%values%append(this%file, field_values, error)
      if (this%note(error)) return
   end subroutine point_integers

   subroutine cell_reals(this, name, field_values)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=*), intent(in) :: name
      !> (cells)
      real(wp), intent(in) :: field_values(:)
      character(len=:), allocatable :: error
      integer :: i
      call find_field(this, this%cell_fields, name, size(field_values), this%n_cells, i)
      if (i == 0) return
      call this%cell_fields(i)%values%append(this%file, field_values, error)
      if (this%note(error)) return
   end subroutine cell_reals

   subroutine cell_rows(this, name, field_values)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=*), intent(in) :: name
      !> (component, cells); components that are not given are zero
      real(wp), intent(in) :: field_values(:, :)
      character(len=:), allocatable :: error
      integer :: i
      call find_field(this, this%cell_fields, name, size(field_values, 2), this%n_cells, i)
      if (i == 0) return
      call this%cell_fields(i)%values%append(this%file, field_values, error)
      if (this%note(error)) return
   end subroutine cell_rows

   subroutine cell_integers(this, name, field_values)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=*), intent(in) :: name
      !> (cells)
      integer, intent(in) :: field_values(:)
      character(len=:), allocatable :: error
      integer :: i
      call find_field(this, this%cell_fields, name, size(field_values), this%n_cells, i)
      if (i == 0) return
      call this%cell_fields(i)%values%append(this%file, field_values, error)
      if (this%note(error)) return
   end subroutine cell_integers

   !> Position of a declared field, made ready for the present frame; 0 if there is or was an error.
   subroutine find_field(this, fields, name, n, n_expected, position)
      class(vtkhdf_file_t), intent(inout) :: this
      type(stored_field_t), intent(inout) :: fields(:)
      character(len=*), intent(in) :: name
      !> values given
      integer, intent(in) :: n
      !> points or cells of the geometry
      integer, intent(in) :: n_expected
      integer, intent(out) :: position
      character(len=:), allocatable :: error
      integer :: i
      position = 0
      if (allocated(this%failure)) return
      do i = 1, size(fields)
         if (last_part(fields(i)%values%name) == name) position = i
      end do
      if (position == 0) then
         error = this%file%path//': the field '//name//' was not declared'
      else if (n /= n_expected .or. .not. this%in_frame) then
         error = this%file%path//': the field '//name//' does not fit the geometry, or no frame is open'
      end if
      if (this%note(error)) position = 0
      if (position == 0) return
      fields(position)%start = fields(position)%values%rows
      fields(position)%geometry = this%geometries
   end subroutine find_field

   !> What stands behind the last slash.
   pure function last_part(path) result(name)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: name
      name = path(index(path, '/', back=.true.) + 1:)
   end function last_part

   !> Finish the frame: from here on it can be read, whatever happens.
   subroutine end_frame(this, error)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable :: problem
      call finish_fields(this, this%point_fields)
      call finish_fields(this, this%cell_fields)
      if (.not. allocated(this%failure)) then
         call write_step(this, problem)
         if (.not. allocated(problem)) call this%file%flush(problem)
         if (.not. this%note(problem)) this%frames = this%frames + 1
      end if
      this%in_frame = .false.
      if (allocated(this%failure)) error = this%failure
   end subroutine end_frame

   !> Enter the frame into the list of time steps. VTK (9.7) overruns its memory where there are more times than NSteps, so nothing
   !> of this is written before the frame is complete, the time comes last, and one flush hands on all of it.
   subroutine write_step(this, error)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      associate (layout => this%layout)
         do i = part_offsets, layout_size
            select case (i)
            case (part_offsets); call layout(i)%append(this%file, [this%geometries - 1], error)
            case (number_of_parts); call layout(i)%append(this%file, [1], error)
            case (point_offsets); call layout(i)%append(this%file, [this%first_point], error)
            case (cell_offsets); call layout(i)%append(this%file, [this%first_cell], error)
            case (id_offsets); call layout(i)%append(this%file, [this%first_id], error)
            case (kinds); call layout(i)%append(this%file, [this%kind], error)
            case (kind_offsets); call layout(i)%append(this%file, [layout(kinds)%rows - 1], error)
            case (kind_sizes); call layout(i)%append(this%file, [1_i8, 1_i8], error) ! components, tuples
            case (values); call layout(i)%append(this%file, [this%written_time], error)
            end select
            if (allocated(error)) return
         end do
      end associate
      call this%file%set_attribute('/VTKHDF/Steps', 'NSteps', this%frames + 1, error)
   end subroutine write_step

   !> Note for each field where its values of this frame are: new ones, or those of an earlier frame of the same geometry.
   subroutine finish_fields(this, fields)
      class(vtkhdf_file_t), intent(inout) :: this
      type(stored_field_t), intent(inout) :: fields(:)
      character(len=:), allocatable :: error
      integer :: i
      do i = 1, size(fields)
         if (allocated(this%failure)) return
         if (fields(i)%geometry == this%geometries) then
            call fields(i)%offsets%append(this%file, [fields(i)%start], error)
         else
            error = this%file%path//': the field '//last_part(fields(i)%values%name)//' has no values on this geometry'
         end if
         if (this%note(error)) return
      end do
   end subroutine finish_fields

   !> Close the file. After an error it keeps the frames that were finished.
   subroutine close_file(this, error)
      class(vtkhdf_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable :: problem
      logical :: failed
      if (.not. this%file%is_open()) return
      if (.not. this%started .and. .not. allocated(this%failure)) call this%start(0, 0)
      call close_series(this)
      call this%file%close(problem)
      failed = this%note(problem)
      if (failed) error = this%failure
   end subroutine close_file

   subroutine close_series(this)
      class(vtkhdf_file_t), intent(inout) :: this
      integer :: i
      do i = 1, layout_size
         call this%layout(i)%close()
      end do
      do i = 1, size(this%point_fields)
         call this%point_fields(i)%values%close()
         call this%point_fields(i)%offsets%close()
      end do
      do i = 1, size(this%cell_fields)
         call this%cell_fields(i)%values%close()
         call this%cell_fields(i)%offsets%close()
      end do
   end subroutine close_series

   !> Close and delete the file, if this run made it.
   subroutine discard(this, keep)
      class(vtkhdf_file_t), intent(inout) :: this
      !> leave what is finished instead of deleting it (default: no)
      logical, intent(in), optional :: keep
      if (allocated(this%point_fields)) call close_series(this)
      call this%file%discard(keep, sound=.not. allocated(this%failure))
   end subroutine discard

   !> After `discard`: make an ordinary file of what is left, with so many frames. Points and values of a frame that was not
   !> finished may stay in the file, but no frame refers to them: cutting these compressed series would need room, which a full
   !> disk has not.
   subroutine mend(this, frames)
      class(vtkhdf_file_t), intent(inout) :: this
      !> at most those that are finished
      integer, intent(in) :: frames
      character(len=:), allocatable :: path, error
      integer :: i
      path = this%file%path
      call this%file%reopen(path, error)
      if (allocated(error)) return
      do i = part_offsets, layout_size
         if (.not. allocated(error)) call this%layout(i)%cut(this%file, int(frames, i8), .false., error)
      end do
      do i = 1, size(this%point_fields)
         if (.not. allocated(error)) call this%point_fields(i)%offsets%cut(this%file, int(frames, i8), .false., error)
      end do
      do i = 1, size(this%cell_fields)
         if (.not. allocated(error)) call this%cell_fields(i)%offsets%cut(this%file, int(frames, i8), .false., error)
      end do
      if (.not. allocated(error)) call this%file%set_attribute('/VTKHDF/Steps', 'NSteps', frames, error)
      call close_series(this)
      call this%file%discard(keep=.true., sound=.not. allocated(error))
   end subroutine mend

   !> Frames that are finished.
   pure integer function frame_count(this)
      class(vtkhdf_file_t), intent(in) :: this
      frame_count = this%frames
   end function frame_count
end module rf_vtkhdf
