!> A run as an input file of ANSYS (APDL), the program in which the paper's authors looked at their results: it rebuilds the mesh,
!> the broken interfaces, the displacements and the stresses of any frame.
!>
!> In ANSYS, `*USE,JOB.mac,3` shows the third frame and `*USE,JOB.mac` the last one. Frames count from 1.
!>
!> Choices, with reasons:
!> - Triangles are PLANE182 with the third node given twice (EN,id,i,j,k,k): the documented 3-node form of ANSYS's present 4-node
!>   element, in which its shape functions become those of the constant strain triangle. PLANE2 had six nodes and is no longer
!>   documented.
!> - Broken interfaces are MESH200 lines, one along each side: elements that are drawn, selected and listed but take no part in a
!>   solution, so they need no contact settings. One element type for each mode, and components CRACK_EXISTING, CRACK_TENSION,
!>   CRACK_SHEAR. The two sides of an interface follow each other, so the pair can be told.
!> - POST1 changes results only where there are some. So each mesh is solved once with every node held (but for one direction of one
!>   node, as ANSYS wants at least one unknown); DNSOL and DESOL then put the fields in. Materials are therefore of no account.
!> - Nodes and elements one a line (N, EN), not in blocks (NBLOCK, EBLOCK): ANSYS does not skip blocks inside *IF.
module rf_apdl
   use rf_kinds, only: wp, i8
   use rf_archive, only: archive_t
   use rf_text_file, only: text_file_t
   use rf_text, only: to_text
   implicit none
   private

   !> modes of a broken interface, in the order of element types and components
   integer, parameter, public :: mode_existing = 0, mode_tension = 1, mode_shear = 2
   !> element types: triangles in plane strain and in plane stress, then lines by mode
   integer, parameter :: type_plane_strain = 1, type_plane_stress = 2, type_line = 3
   character(len=*), parameter :: components(0:2) = [character(len=14) :: 'CRACK_EXISTING', 'CRACK_TENSION', 'CRACK_SHEAR']
   character(len=*), parameter :: lf = new_line('a')

   type, public :: apdl_t
      type(text_file_t), private :: file
      !> where the number of frames stands, and the last frame of the present mesh
      integer(i8), private :: frames_place = 0, last_place = 0
      integer, private :: frames = 0
      !> ids of the present mesh
      integer, allocatable, private :: node_id(:), element_id(:)
   contains
      procedure :: create
      procedure :: exchange
      procedure :: go_on
      procedure :: begin_geometry
      procedure :: add_interfaces
      procedure :: end_geometry
      procedure :: add_frame
      procedure :: frame_count
      procedure :: close => close_file
      procedure :: discard
   end type apdl_t

contains

   !> Make the file; an existing one is replaced.
   subroutine create(this, path, title, error)
      class(apdl_t), intent(out) :: this
      character(len=*), intent(in) :: path
      !> one line
      character(len=*), intent(in) :: title
      character(len=:), allocatable, intent(out) :: error
      call this%file%create(path, error)
      if (allocated(error)) return
      associate (file => this%file)
         call file%put_line('! '//title)
         call file%put_line('! Written by rfem. In ANSYS: *USE,THIS_FILE,3 shows frame 3; without a number the last frame.')
         call file%put_line('! Then for instance PLNSOL,U,Y or PLESOL,S,1; CMSEL,S,CRACK_TENSION and EPLOT for the cracks.')
         call file%put('RF_FRAMES=')
         this%frames_place = file%position()
         call file%put_line(fixed(0))
         call file%put_line('RF_FRAME=ARG1')
         call file%put_line('*IF,RF_FRAME,LT,1,OR,RF_FRAME,GT,RF_FRAMES,THEN')
         call file%put_line('RF_FRAME=RF_FRAMES')
         call file%put_line('*ENDIF')
         call file%put_line('FINISH')
      end associate
      call this%file%flush(error)
   end subroutine create

   !> To or from a checkpoint.
   subroutine exchange(this, archive)
      class(apdl_t), intent(inout) :: this
      class(archive_t), intent(inout) :: archive
      call archive%enter('file')
      call this%file%exchange(archive)
      call archive%leave()
      call archive%exchange('frames_place', this%frames_place)
      call archive%exchange('last_place', this%last_place)
      call archive%exchange('frames', this%frames)
      call archive%exchange('node_id', this%node_id)
      call archive%exchange('element_id', this%element_id)
   end subroutine exchange

   !> Go on with the file of a checkpoint; the numbers of frames become those of then.
   subroutine go_on(this, path, look_only, error)
      class(apdl_t), intent(inout) :: this
      character(len=*), intent(in) :: path
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      call this%file%go_on(path, look_only, error)
      if (look_only .or. allocated(error)) return
      call this%file%overwrite(this%frames_place, fixed(this%frames))
      if (this%last_place > 0) call this%file%overwrite(this%last_place, fixed(this%frames))
      call this%file%flush(error)
   end subroutine go_on

   !> A frame number in the room that is kept for it.
   pure function fixed(number) result(text)
      integer, intent(in) :: number
      character(len=8) :: text
      write (text, '(i8)') number
   end function fixed

   !> Begin a mesh: nodes and triangles. `add_interfaces` and `end_geometry` follow; frames from then on are on this mesh.
   subroutine begin_geometry(this, node_id, x, element_id, connectivity, material, plane_strain)
      class(apdl_t), intent(inout) :: this
      !> (nodes)
      integer, intent(in) :: node_id(:)
      !> reference coordinates [length], (2, nodes)
      real(wp), intent(in) :: x(:, :)
      !> (elements)
      integer, intent(in) :: element_id(:)
      !> positions in node_id, (3, elements)
      integer, intent(in) :: connectivity(:, :)
      !> material number from 1, (elements)
      integer, intent(in) :: material(:)
      !> false: plane stress, (elements)
      logical, intent(in) :: plane_strain(:)
      integer :: i, present_material, present_type, element_type
      this%node_id = node_id
      this%element_id = element_id
      call put_preamble(this, maxval([1, material]))
      do i = 1, size(node_id)
         call this%file%put('N,'//to_text(node_id(i))//','//number(x(1, i))//','//number(x(2, i))//lf)
      end do
      present_material = 0; present_type = 0
      do i = 1, size(element_id)
         element_type = merge(type_plane_strain, type_plane_stress, plane_strain(i))
         if (element_type /= present_type) call this%file%put_line('TYPE,'//to_text(element_type))
         if (material(i) /= present_material) call this%file%put_line('MAT,'//to_text(material(i)))
         present_type = element_type; present_material = material(i)
         call this%file%put('EN,'//to_text(element_id(i))//ids_text(this, connectivity([1, 2, 3, 3], i))//lf)
      end do
   end subroutine begin_geometry

   !> The condition under which this mesh is read, an empty model, element types and materials.
   subroutine put_preamble(this, n_materials)
      class(apdl_t), intent(inout) :: this
      !> highest material number
      integer, intent(in) :: n_materials
      integer :: i
      associate (file => this%file)
         call file%put('*IF,RF_FRAME,GE,'//to_text(this%frames + 1)//',AND,RF_FRAME,LE,')
         this%last_place = file%position()
         call file%put_line(fixed(this%frames)//',THEN')
         call file%put_line('/PREP7')
         call file%put_line('ALLSEL')
         call file%put_line('EDELE,ALL')
         call file%put_line('NDELE,ALL')
         call file%put_line('ET,'//to_text(type_plane_strain)//',PLANE182,,,2')
         call file%put_line('ET,'//to_text(type_plane_stress)//',PLANE182,,,0')
         do i = 0, ubound(components, 1)
            call file%put_line('ET,'//to_text(type_line + i)//',MESH200,0')
         end do
         do i = 1, n_materials
            call file%put_line('MP,EX,'//to_text(i)//',1')
            call file%put_line('MP,PRXY,'//to_text(i)//',0')
         end do
      end associate
   end subroutine put_preamble

   !> Add the broken interfaces of the mesh.
   subroutine add_interfaces(this, sides, mode)
      class(apdl_t), intent(inout) :: this
      !> positions of nodes: first side's two ends, second side's ends opposite to them, (4, interfaces)
      integer, intent(in) :: sides(:, :)
      !> mode_existing, mode_tension or mode_shear, (interfaces)
      integer, intent(in) :: mode(:)
      integer :: i, m
      do m = 0, ubound(components, 1)
         if (.not. any(mode == m)) cycle
         call this%file%put_line('TYPE,'//to_text(type_line + m))
         do i = 1, size(mode)
            if (mode(i) /= m) cycle
            call put_line_element(this, sides(1:2, i))
            call put_line_element(this, sides(3:4, i))
         end do
         call this%file%put_line('ESEL,S,TYPE,,'//to_text(type_line + m))
         call this%file%put_line('CM,'//trim(components(m))//',ELEM')
         call this%file%put_line('ESEL,ALL')
      end do
   end subroutine add_interfaces

   !> A line between two nodes; ANSYS numbers it on from the largest element.
   subroutine put_line_element(this, ends)
      class(apdl_t), intent(inout) :: this
      !> positions of its nodes
      integer, intent(in) :: ends(2)
      call this%file%put('E'//ids_text(this, ends)//lf)
   end subroutine put_line_element

   !> Ids of nodes, each after a comma.
   pure function ids_text(this, positions) result(text)
      class(apdl_t), intent(in) :: this
      !> positions in node_id
      integer, intent(in) :: positions(:)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(positions)
         text = text//','//to_text(this%node_id(positions(i)))
      end do
   end function ids_text

   !> Finish the mesh: the solution that POST1 needs.
   subroutine end_geometry(this, error)
      class(apdl_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      associate (file => this%file)
         call file%put_line('FINISH')
         call file%put_line('/SOLU')
         call file%put_line('ANTYPE,STATIC')
         call file%put_line('D,ALL,ALL,0')
         if (size(this%node_id) > 0) call file%put_line('DDELE,'//to_text(this%node_id(1))//',UX')
         call file%put_line('SOLVE')
         call file%put_line('FINISH')
         call file%put_line('*ENDIF')
      end associate
      call this%file%flush(error)
   end subroutine end_geometry

   !> Add a frame on the present mesh.
   subroutine add_frame(this, time, displacement, stress, error)
      class(apdl_t), intent(inout) :: this
      !> total time [time]
      real(wp), intent(in) :: time
      !> [length], (2, nodes)
      real(wp), intent(in) :: displacement(:, :)
      !> of the elements [stress], tension positive, (6, elements): XX YY ZZ XY YZ XZ, which is ANSYS's order too
      real(wp), intent(in) :: stress(:, :)
      character(len=:), allocatable, intent(out) :: error
      integer :: i
      this%frames = this%frames + 1
      associate (file => this%file)
         call file%put_line('*IF,RF_FRAME,EQ,'//to_text(this%frames)//',THEN')
         call file%put_line('/TITLE,frame '//to_text(this%frames)//', time '//to_text(time))
         call file%put_line('/POST1')
         call file%put_line('SET,LAST')
         call file%put_line('/GRAPHICS,FULL') ! DNSOL and DESOL do not reach PowerGraphics
         do i = 1, size(this%node_id)
            call file%put('DNSOL,'//to_text(this%node_id(i))//',U,X,'//number(displacement(1, i))//','// &
                          number(displacement(2, i))//lf)
         end do
         do i = 1, size(this%element_id)
            call put_stress(this, this%element_id(i), stress(:, i))
         end do
         call file%put_line('*ENDIF')
      end associate
      call this%file%overwrite(this%last_place, fixed(this%frames))
      call this%file%overwrite(this%frames_place, fixed(this%frames))
      call this%file%flush(error)
      if (allocated(error)) this%frames = this%frames - 1
   end subroutine add_frame

   !> Frames that are finished.
   pure integer function frame_count(this)
      class(apdl_t), intent(in) :: this
      frame_count = this%frames
   end function frame_count

   subroutine put_stress(this, id, stress)
      class(apdl_t), intent(inout) :: this
      !> the element
      integer, intent(in) :: id
      !> XX YY ZZ XY YZ XZ [stress]
      real(wp), intent(in) :: stress(6)
      integer :: k
      call this%file%put('DESOL,'//to_text(id)//',ALL,S,X')
      do k = 1, 6
         call this%file%put(','//number(stress(k)))
      end do
      call this%file%put(lf)
   end subroutine put_stress

   !> A number with all the digits that tell it from others; quicker than the shortest form.
   function number(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      if (abs(value) <= 0.0_wp) then
         text = '0'
      else
         write (buffer, '(es24.16e3)') value
         text = trim(adjustl(buffer))
      end if
   end function number

   subroutine close_file(this, error)
      class(apdl_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      call this%file%close(error)
   end subroutine close_file

   !> Close and delete the file, if this run made it.
   subroutine discard(this, keep)
      class(apdl_t), intent(inout) :: this
      !> leave what is finished instead of deleting it (default: no)
      logical, intent(in), optional :: keep
      call this%file%discard(keep)
   end subroutine discard
end module rf_apdl
