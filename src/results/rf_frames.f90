!> Frames of a run: JOB.vtkhdf with mesh and fields, JOB_cracks.vtkhdf with the crack segments, JOB.mac for ANSYS. Nodes
!> and elements stand in the deck's order, then in order of creation, whatever the internal numbering.
module rf_frames
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_model, only: model_t
   use rf_topology, only: side_nodes
   use rf_fields, only: field_t, point_fields, cell_fields, with_fracture, with_dynamics
   use rf_position, only: position_t
   use rf_crack_figures, only: segment_figures_t, look_at_segment
   use rf_vtkhdf, only: vtkhdf_file_t, vtkhdf_field_t, vtkhdf_field, vtk_triangle, vtk_line, real_64, real_32, integer_32
   use rf_apdl, only: apdl_t
   implicit none
   private
   public :: frames_t

   !> fields of the crack segments that are whole numbers, and those that are not
   character(len=15), parameter :: crack_reals(4) = [character(len=15) :: 'opening', 'slip', 'shear_traction', 'normal_traction']
   character(len=15), parameter :: crack_integers(3) = [character(len=15) :: 'state', 'mode', 'event']

   type :: frames_t
      logical :: vtkhdf = .false., apdl = .false.
      type(field_t), allocatable, private :: points(:), cells(:)
      type(vtkhdf_file_t), private :: mesh_file, crack_file
      type(apdl_t), private :: apdl_file
      !> changes of the mesh that the geometry in the files has seen; -1: none is there
      integer, private :: mesh_changes = -1
   contains
      procedure :: exchange, go_on, look_at_text, release
      procedure :: create, write_frame, close => close_files, discard
      procedure, private :: write_mesh, write_cracks, write_apdl
   end type frames_t

contains

   !> Make the files.
   subroutine create(self, prefix, title, fracture, dynamic, error)
      class(frames_t), intent(inout) :: self
      !> folder and job name; first line of the deck's heading
      character(len=*), intent(in) :: prefix, title
      !> some step looks at the criterion; some step is dynamic
      logical, intent(in) :: fracture, dynamic
      character(len=:), allocatable, intent(out) :: error
      type(vtkhdf_field_t) :: none(0)
      if (self%vtkhdf) then
         call choose_fields(self, fracture, dynamic)
         call self%mesh_file%create(prefix//'.vtkhdf', vtk_triangle, as_vtkhdf(self%points), as_vtkhdf(self%cells), error)
         if (allocated(error)) return
         call self%crack_file%create(prefix//'_cracks.vtkhdf', vtk_line, none, crack_fields(), error)
         if (allocated(error)) return
      end if
      if (self%apdl) call self%apdl_file%create(prefix//'.mac', title, error)
   end subroutine create

   !> The fields that the steps of the deck have.
   subroutine choose_fields(self, fracture, dynamic)
      class(frames_t), intent(inout) :: self
      !> some step looks at the criterion; some step is dynamic
      logical, intent(in) :: fracture, dynamic
      call point_fields(self%points)
      call cell_fields(self%cells)
      if (.not. fracture) then
         self%points = pack(self%points, self%points%present_when /= with_fracture)
         self%cells = pack(self%cells, self%cells%present_when /= with_fracture)
      end if
      if (.not. dynamic) self%points = pack(self%points, self%points%present_when /= with_dynamics)
   end subroutine choose_fields

   !> Fields of the crack segments.
   function crack_fields() result(cracks)
      type(vtkhdf_field_t), allocatable :: cracks(:)
      integer :: i
      allocate (cracks(size(crack_reals) + size(crack_integers)))
      do i = 1, size(crack_reals)
         cracks(i) = vtkhdf_field(trim(crack_reals(i)))
      end do
      do i = 1, size(crack_integers)
         cracks(size(crack_reals) + i) = vtkhdf_field(trim(crack_integers(i)), element=integer_32)
      end do
   end function crack_fields

   !> To or from a checkpoint. (Derived: vtkhdf, apdl, points, cells follow from the deck.)
   subroutine exchange(self, archive)
      class(frames_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('mesh_changes', self%mesh_changes)
      call archive%enter('mesh_file')
      call self%mesh_file%exchange(archive)
      call archive%leave()
      call archive%enter('crack_file')
      call self%crack_file%exchange(archive)
      call archive%leave()
      call archive%enter('apdl_file')
      call self%apdl_file%exchange(archive)
      call archive%leave()
   end subroutine exchange

   !> Look whether the run can go on with the text file, which becomes this process's alone.
   subroutine look_at_text(self, prefix, error)
      class(frames_t), intent(inout) :: self
      !> folder and job name
      character(len=*), intent(in) :: prefix
      character(len=:), allocatable, intent(out) :: error
      if (self%apdl) call self%apdl_file%go_on(prefix//'.mac', .true., error)
   end subroutine look_at_text

   !> Give back what was looked at only.
   subroutine release(self)
      class(frames_t), intent(inout) :: self
      if (self%apdl) call self%apdl_file%discard(keep=.true.)
   end subroutine release

   !> Go on with the files of a checkpoint.
   subroutine go_on(self, prefix, fracture, dynamic, look_only, error)
      class(frames_t), intent(inout) :: self
      !> as of `create`
      character(len=*), intent(in) :: prefix
      logical, intent(in) :: fracture, dynamic
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      type(vtkhdf_field_t) :: none(0)
      if (self%vtkhdf) then
         call choose_fields(self, fracture, dynamic)
         call self%mesh_file%go_on(prefix//'.vtkhdf', vtk_triangle, as_vtkhdf(self%points), as_vtkhdf(self%cells), look_only, error)
         if (allocated(error)) return
         call self%crack_file%go_on(prefix//'_cracks.vtkhdf', vtk_line, none, crack_fields(), look_only, error)
         if (allocated(error)) return
      end if
      if (self%apdl) call self%apdl_file%go_on(prefix//'.mac', look_only, error)
   end subroutine go_on

   function as_vtkhdf(fields) result(list)
      type(field_t), intent(in) :: fields(:)
      type(vtkhdf_field_t), allocatable :: list(:)
      integer :: i, element
      allocate (list(size(fields)))
      do i = 1, size(fields)
         element = merge(real_64, real_32, fields(i)%double)
         if (fields(i)%whole) element = integer_32
         list(i) = vtkhdf_field(fields(i)%name, fields(i)%components, element)
      end do
   end function as_vtkhdf

   !> Add a frame of the present state. Stress of every node is up to date.
   subroutine write_frame(self, model, position, kind, error)
      class(frames_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      integer, intent(in) :: kind
      character(len=:), allocatable, intent(out) :: error
      logical :: changed
      changed = self%mesh_changes /= model%mesh_changes
      self%mesh_changes = model%mesh_changes
      if (self%vtkhdf) then
         call self%write_mesh(model, position, kind, changed, error)
         if (.not. allocated(error)) call self%write_cracks(model, position, kind, changed, error)
      end if
      if (self%apdl .and. .not. allocated(error)) call self%write_apdl(model, position, changed, error)
   end subroutine write_frame

   subroutine write_mesh(self, model, position, kind, changed, error)
      class(frames_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      integer, intent(in) :: kind
      !> the mesh is not the one of the last frame
      logical, intent(in) :: changed
      character(len=:), allocatable, intent(out) :: error
      integer, allocatable :: connectivity(:, :)
      real(wp), allocatable :: x(:, :), values(:, :)
      integer :: i, e
      associate (mesh => model%mesh)
         if (changed) then
            allocate (x(2, mesh%n_nodes), connectivity(3, mesh%n_elements))
            x(:, mesh%node_rank(:mesh%n_nodes)) = mesh%x(:, :mesh%n_nodes)
            do e = 1, mesh%n_elements
               connectivity(:, mesh%element_rank(e)) = mesh%node_rank(mesh%connectivity(:, e))
            end do
            call self%mesh_file%add_geometry(x, connectivity)
         end if
         call self%mesh_file%begin_frame(position%time, kind)
         do i = 1, size(self%points)
            call ranked(self%points(i), mesh%n_nodes, mesh%node_rank)
            if (self%points(i)%components > 1) then
               call self%mesh_file%point_data(self%points(i)%name, values)
            else if (self%points(i)%whole) then
               call self%mesh_file%point_data(self%points(i)%name, nint(values(1, :)))
            else
               call self%mesh_file%point_data(self%points(i)%name, values(1, :))
            end if
         end do
         do i = 1, size(self%cells)
            call ranked(self%cells(i), mesh%n_elements, mesh%element_rank)
            if (self%cells(i)%components > 1) then
               call self%mesh_file%cell_data(self%cells(i)%name, values)
            else if (self%cells(i)%whole) then
               call self%mesh_file%cell_data(self%cells(i)%name, nint(values(1, :)))
            else
               call self%mesh_file%cell_data(self%cells(i)%name, values(1, :))
            end if
         end do
      end associate
      call self%mesh_file%end_frame(error)

   contains

      !> Values of a field in the order of the output.
      subroutine ranked(field, n, rank)
         type(field_t), intent(in) :: field
         integer, intent(in) :: n
         integer, intent(in) :: rank(:)
         real(wp), allocatable :: internal(:, :)
         integer :: j
         allocate (internal(field%components, n))
         if (allocated(values)) deallocate (values)
         allocate (values(field%components, n))
         call field%fill(model, internal)
         do j = 1, n
            values(:, rank(j)) = internal(:, j)
         end do
      end subroutine ranked

   end subroutine write_mesh

   subroutine write_cracks(self, model, position, kind, changed, error)
      class(frames_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      integer, intent(in) :: kind
      logical, intent(in) :: changed
      character(len=:), allocatable, intent(out) :: error
      type(segment_figures_t), allocatable :: found(:)
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: lines(:, :)
      integer :: s, n
      n = model%mesh%n_segments
      allocate (found(n))
      do s = 1, n
         call look_at_segment(model, s, found(s))
      end do
      if (changed) then
         allocate (x(2, 2*n), lines(2, n))
         do s = 1, n
            x(:, 2*s - 1:2*s) = found(s)%x
            lines(:, s) = [2*s - 1, 2*s]
         end do
         call self%crack_file%add_geometry(x, lines)
      end if
      call self%crack_file%begin_frame(position%time, kind)
      call self%crack_file%cell_data('opening', found%opening)
      call self%crack_file%cell_data('slip', found%slip)
      call self%crack_file%cell_data('shear_traction', found%shear_traction)
      call self%crack_file%cell_data('normal_traction', found%normal_traction)
      call self%crack_file%cell_data('state', found%state)
      if (n > 0) then
         call self%crack_file%cell_data('mode', int(model%mesh%segment_mode(:n)))
         call self%crack_file%cell_data('event', model%mesh%segment_event(:n))
      else
         call self%crack_file%cell_data('mode', found%state)
         call self%crack_file%cell_data('event', found%state)
      end if
      call self%crack_file%end_frame(error)
   end subroutine write_cracks

   subroutine write_apdl(self, model, position, changed, error)
      class(frames_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      logical, intent(in) :: changed
      character(len=:), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :), u(:, :), stress(:, :), internal(:, :)
      integer, allocatable :: connectivity(:, :), sides(:, :)
      integer :: e, n, s, ends(2, 2)
      type(field_t), allocatable :: fields(:)
      associate (mesh => model%mesh)
         if (changed) then
            allocate (x(2, mesh%n_nodes), connectivity(3, mesh%n_elements), sides(4, mesh%n_segments))
            x(:, mesh%node_rank(:mesh%n_nodes)) = mesh%x(:, :mesh%n_nodes)
            do e = 1, mesh%n_elements
               connectivity(:, mesh%element_rank(e)) = mesh%node_rank(mesh%connectivity(:, e))
            end do
            call self%apdl_file%begin_geometry(by_rank(mesh%node_id, mesh%node_rank, mesh%n_nodes), x, &
                                               by_rank(mesh%element_id, mesh%element_rank, mesh%n_elements), connectivity, &
                                               by_rank(model%material%section(mesh%section(:mesh%n_elements))%material, &
                                                       mesh%element_rank, mesh%n_elements), &
                                               by_rank_flag(model%material%section(mesh%section(:mesh%n_elements))%plane_strain, &
                                                            mesh%element_rank, mesh%n_elements))
            do s = 1, mesh%n_segments
               ends = side_nodes(mesh, s)
               sides(:, s) = mesh%node_rank([ends(1, 1), ends(2, 1), ends(1, 2), ends(2, 2)])
            end do
            if (mesh%n_segments > 0) &
               call self%apdl_file%add_interfaces(sides, int(mesh%segment_mode(:mesh%n_segments)))
            call self%apdl_file%end_geometry(error)
            if (allocated(error)) return
         end if
         call cell_fields(fields)
         allocate (u(2, mesh%n_nodes), internal(6, mesh%n_elements), stress(6, mesh%n_elements))
         call fields(1)%fill(model, internal)
         stress(:, mesh%element_rank(:mesh%n_elements)) = internal
         do n = 1, mesh%n_nodes
            u(:, mesh%node_rank(n)) = [model%motion%ux(n), model%motion%uy(n)]
         end do
      end associate
      call self%apdl_file%add_frame(position%time, u, stress, error)
   end subroutine write_apdl

   pure function by_rank(values, rank, n) result(sorted)
      integer, intent(in) :: values(:), rank(:), n
      integer :: sorted(n)
      sorted(rank(:n)) = values(:n)
   end function by_rank

   pure function by_rank_flag(values, rank, n) result(sorted)
      logical, intent(in) :: values(:)
      integer, intent(in) :: rank(:), n
      logical :: sorted(n)
      sorted(rank(:n)) = values(:n)
   end function by_rank_flag

   subroutine close_files(self, error)
      class(frames_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable :: later
      if (self%vtkhdf) then
         call self%mesh_file%close(error)
         call self%crack_file%close(later)
         if (.not. allocated(error) .and. allocated(later)) error = later
      end if
      if (.not. self%apdl) return
      call self%apdl_file%close(later)
      if (.not. allocated(error) .and. allocated(later)) error = later
   end subroutine close_files

   !> Close; the frames that both files have finished stay, and what has none is deleted unless a checkpoint goes with it.
   subroutine discard(self, resumable)
      class(frames_t), intent(inout) :: self
      !> there is a checkpoint
      logical, intent(in) :: resumable
      integer :: frames
      if (self%vtkhdf) then
         frames = min(self%mesh_file%frame_count(), self%crack_file%frame_count())
         call self%mesh_file%discard(keep=resumable .or. frames > 0)
         call self%crack_file%discard(keep=resumable .or. frames > 0)
         if (frames > 0) call self%mesh_file%mend(frames)
         if (frames > 0) call self%crack_file%mend(frames)
      end if
      if (self%apdl) call self%apdl_file%discard(keep=resumable .or. self%apdl_file%frame_count() > 0)
   end subroutine discard

end module rf_frames
