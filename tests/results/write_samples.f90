!> Writes result files of known content, for test_read_back.py and for tests with kill -9 and full disks.
!>
!> `write_samples samples FOLDER` all kinds of file, small · `endless FILE` frames until it is killed, each told on standard output
!> · `fill KIND FILE N` frames, rows or tables (KIND vtkhdf, h5, csv, dat or mac), at most N, until the disk is full: prints the
!> error, discards, exit 3 · `keep FILE N` the same for frames, but closes the file instead of discarding it.
program write_samples
   use, intrinsic :: iso_fortran_env, only: output_unit
   use rf_kinds, only: wp
   use rf_system, only: exit_program
   use rf_hdf5, only: hdf5_file_t, open_objects
   use rf_vtkhdf, only: vtkhdf_file_t, vtkhdf_field, vtk_triangle, vtk_line, real_64, integer_32
   use rf_table, only: table_t, column, column_integer, column_text
   use rf_ascii, only: csv_t, dat_t, dat_displacements, dat_forces, dat_stresses, dat_strains
   use rf_apdl, only: apdl_t, mode_tension, mode_shear, mode_existing
   implicit none
   character(len=:), allocatable :: failed
   integer :: left_open

   select case (argument(1))
   case ('samples')
      call write_frames(argument(2)//'/sample.vtkhdf', failed)
      if (.not. allocated(failed)) call write_cracks(argument(2)//'/sample_cracks.vtkhdf', failed)
      if (.not. allocated(failed)) call write_tables(argument(2)//'/sample', failed)
      if (.not. allocated(failed)) call write_dat(argument(2)//'/sample.dat', failed)
      if (.not. allocated(failed)) call write_mac(argument(2)//'/sample.mac', failed)
   case ('endless')
      call write_many(argument(2), huge(1), .true., failed)
   case ('fill')
      call fill(argument(2), argument(3), whole_number(argument(4)), failed)
   case ('keep')
      call write_many(argument(2), whole_number(argument(3)), .false., failed)
   case default
      failed = 'unknown task'
   end select
   left_open = open_objects()
   if (allocated(failed)) write (output_unit, '(a)') failed
   if (left_open /= 0) write (output_unit, '(i0, a)') left_open, ' HDF5 objects left open'
   if (allocated(failed)) call exit_program(3)
   if (left_open /= 0) call exit_program(1)

contains

   function argument(i) result(text)
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      integer :: length
      call get_command_argument(i, length=length)
      allocate (character(len=length) :: text)
      call get_command_argument(i, text)
   end function argument

   integer function whole_number(text)
      character(len=*), intent(in) :: text
      read (text, *) whole_number
   end function whole_number

   !> A strip of n squares, each cut into two triangles.
   subroutine strip(n, x, cells)
      integer, intent(in) :: n
      real(wp), allocatable, intent(out) :: x(:, :)
      integer, allocatable, intent(out) :: cells(:, :)
      integer :: i
      allocate (x(2, 2*n + 2), cells(3, 2*n))
      do i = 0, n
         x(:, 2*i + 1) = [0.1_wp*i, 0.0_wp]
         x(:, 2*i + 2) = [0.1_wp*i, 1.0_wp/3.0_wp]
      end do
      do i = 1, n
         cells(:, 2*i - 1) = [2*i - 1, 2*i + 1, 2*i + 2]
         cells(:, 2*i) = [2*i - 1, 2*i + 2, 2*i]
      end do
   end subroutine strip

   !> A value that tells frame, component and position.
   elemental real(wp) function known(frame, component, position)
      integer, intent(in) :: frame, component, position
      known = frame + 0.1_wp*component + 1.0e-3_wp*position + 1.0e-10_wp/3.0_wp
   end function known

   !> Six frames: times 0 0 1 1 1 2, three on a strip of 3 squares, three on one of 700 (more rows than are stored as one piece).
   subroutine write_frames(path, error)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      type(vtkhdf_file_t) :: file
      real(wp), parameter :: times(0:5) = [0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 2.0_wp]
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: cells(:, :)
      integer :: frame, i, k
      call file%create(path, vtk_triangle, [vtkhdf_field('displacement', 3, real_64), vtkhdf_field('stress', 6), &
                       vtkhdf_field('sigma1'), vtkhdf_field('node_id', element=integer_32)], &
                       [vtkhdf_field('stress', 6), vtkhdf_field('strength_factor'), &
                       vtkhdf_field('element_id', element=integer_32)], error)
      if (allocated(error)) return
      do frame = 0, 5
         if (frame == 0 .or. frame == 3) then
            call strip(merge(3, 700, frame == 0), x, cells)
            call file%add_geometry(x, cells)
         end if
         call file%begin_frame(times(frame), mod(frame, 5))
         call file%point_data('displacement', reshape([((known(frame, k, i), k=1, 2), i=1, size(x, 2))], shape(x)))
         call file%point_data('stress', reshape([((known(frame, k, i), k=1, 6), i=1, size(x, 2))], [6, size(x, 2)]))
         call file%point_data('sigma1', [(known(frame, 7, i), i=1, size(x, 2))])
         call file%cell_data('stress', reshape([((known(frame, k, i), k=1, 6), i=1, size(cells, 2))], [6, size(cells, 2)]))
         call file%cell_data('strength_factor', [(known(frame, 8, i), i=1, size(cells, 2))])
         if (frame == 0 .or. frame == 3) then
            call file%point_data('node_id', [(10*i, i=1, size(x, 2))])
            call file%cell_data('element_id', [(100*i, i=1, size(cells, 2))])
         end if
         call file%end_frame(error)
         if (allocated(error)) return
      end do
      call file%close(error)
   end subroutine write_frames

   !> The same six frames of cracks: none in the first three, one in two, then three.
   subroutine write_cracks(path, error)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      type(vtkhdf_file_t) :: file
      integer, parameter :: segments(0:5) = [0, 0, 0, 1, 1, 3]
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: cells(:, :)
      integer :: frame, i, n
      call file%create(path, vtk_line, [vtkhdf_field('displacement', 3, real_64)], &
                       [vtkhdf_field('opening', element=real_64), vtkhdf_field('mode', element=integer_32)], error)
      if (allocated(error)) return
      do frame = 0, 5
         n = segments(frame)
         if (frame == 0 .or. frame == 3 .or. frame == 5) then
            x = reshape([(0.5_wp*i, i=1, 4*n)], [2, 2*n])
            cells = reshape([(i, i=1, 2*n)], [2, n])
            call file%add_geometry(x, cells)
         end if
         call file%begin_frame(real(frame, wp), 0)
         call file%point_data('displacement', 0.1_wp*x)
         call file%cell_data('opening', [(known(frame, 1, i), i=1, n)])
         call file%cell_data('mode', [(1, i=1, n)])
         call file%end_frame(error)
         if (allocated(error)) return
      end do
      call file%close(error)
   end subroutine write_cracks

   !> Provenance, history and events.
   subroutine write_tables(job, error)
      character(len=*), intent(in) :: job
      character(len=:), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(table_t) :: history, events
      integer :: i
      call file%create(job//'.h5', error)
      if (.not. allocated(error)) call file%add_group('/rfem', error)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'version', '0.1.0', error)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'threads', 2, error)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'empty', '', error)
      if (.not. allocated(error)) call file%add_dataset('/rfem/deck', repeat('*HEADING, Grüße'//new_line('a'), 20000), error)
      if (.not. allocated(error)) call file%add_dataset('/rfem/setting_names', ['TOLERANCE', 'JOB      '], error)
      if (.not. allocated(error)) call file%add_dataset('/rfem/numbers', [0.1_wp, 1.0e300_wp], error)
      if (.not. allocated(error)) call file%add_dataset('/rfem/counts', [1, -2, 3], error)
      if (.not. allocated(error)) call history%create(job//'_history.csv', file, '/rfem/history', &
                          [column('step', column_integer), column('time'), column('P, "left"')], error)
      if (.not. allocated(error)) call events%create(job//'_events.csv', file, '/rfem/events', &
                          [column('event', column_integer), column('mode', column_text), column('type', column_text)], error)
      if (.not. allocated(error)) call file%start_swmr(error)
      if (.not. allocated(error)) call history%start(file, error)
      if (.not. allocated(error)) call events%start(file, error)
      if (allocated(error)) return
      do i = 1, 600
         call history%put(i)
         call history%put(i/3.0_wp)
         call history%put(1.0e-7_wp*i**3)
         call history%end_row(file, error)
         if (allocated(error)) return
      end do
      call events%put(1); call events%put('tension'); call events%put('edge')
      call events%end_row(file, error)
      call events%put(2); call events%put('shear'); call events%put('III')
      if (.not. allocated(error)) call events%end_row(file, error)
      if (.not. allocated(error)) call history%close(error)
      if (.not. allocated(error)) call events%close(error)
      if (.not. allocated(error)) call file%end_swmr(error)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'wall_time', 12.5_wp, error)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'exit_status', 0, error)
      if (.not. allocated(error)) call file%set_attribute('/rfem', 'version', '0.1.1-replaced', error)
      if (.not. allocated(error)) call file%close(error)
   end subroutine write_tables

   !> The tables of a deck that ccx ran as well (dat_reference.dat), with its values.
   subroutine write_dat(path, error)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      type(dat_t) :: file
      real(wp), parameter :: u(2, 3) = reshape([0.0_wp, 0.0_wp, 2.314815e-4_wp, -1.234568e-3_wp, 5.291005e-4_wp, &
                                                -1.0e-120_wp], [2, 3])
      real(wp), parameter :: s(6, 2) = reshape([-149.5726_wp, -349.0028_wp, -149.5726_wp, 18.69658_wp, 2.0_wp, 3.0_wp, &
                                                0.0_wp, 1.0e12_wp, -1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [6, 2])
      call file%create(path, error)
      if (.not. allocated(error)) call file%node_table(dat_displacements, 'NALL', 1.0_wp, [1, 3, 100000], u, error)
      if (.not. allocated(error)) call file%node_table(dat_forces, 'BOT', 0.25_wp, [1, 3, 100000], 1000*u, error)
      if (.not. allocated(error)) call file%total_table('BOT', 1.0_wp, [-1.421085e-14_wp, 463.4081_wp], error)
      if (.not. allocated(error)) call file%element_table(dat_stresses, 'EALL', 1.0_wp, [1, 123456], s, error)
      if (.not. allocated(error)) call file%element_table(dat_strains, 'EALL', 123.456_wp, [1, 123456], s/1000, error)
      if (.not. allocated(error)) call file%close(error)
   end subroutine write_dat

   !> Three frames on two meshes; the second has interfaces of all modes.
   subroutine write_mac(path, error)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      type(apdl_t) :: file
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: cells(:, :)
      integer :: frame, i, k, n
      call file%create(path, 'a sample', error)
      do frame = 1, 3
         if (allocated(error)) return
         n = merge(2, 4, frame < 3)
         if (frame /= 2) then
            call strip(n, x, cells)
            call file%begin_geometry([(10*i, i=1, size(x, 2))], x, [(100*i, i=1, size(cells, 2))], cells, &
                                     [(1 + mod(i, 2), i=1, size(cells, 2))], [(i > 1, i=1, size(cells, 2))])
            if (frame == 3) call file%add_interfaces(reshape([1, 2, 3, 4, 3, 4, 5, 4, 5, 6, 7, 8, 7, 8, 9, 10], [4, 4]), &
                                                     [mode_tension, mode_existing, mode_shear, mode_tension])
            call file%end_geometry(error)
            if (allocated(error)) return
         end if
         call file%add_frame(0.5_wp*frame, reshape([((known(frame, k, i), k=1, 2), i=1, size(x, 2))], shape(x)), &
                             reshape([((-known(frame, k, i), k=1, 6), i=1, size(cells, 2))], [6, size(cells, 2)]), error)
      end do
      if (.not. allocated(error)) call file%close(error)
   end subroutine write_mac

   !> Frames on a mesh that grows every third frame; the values tell the frame, so that a reader can check them.
   subroutine write_many(path, n_frames, tell, error)
      character(len=*), intent(in) :: path
      !> frames
      integer, intent(in) :: n_frames
      !> print each finished frame
      logical, intent(in) :: tell
      character(len=:), allocatable, intent(out) :: error
      type(vtkhdf_file_t) :: file
      character(len=:), allocatable :: at_close
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: cells(:, :)
      integer :: frame, i
      call file%create(path, vtk_triangle, [vtkhdf_field('displacement', 3, real_64)], [vtkhdf_field('stress', 6)], error)
      if (allocated(error)) return
      do frame = 0, n_frames - 1
         if (mod(frame, 3) == 0) then
            call strip(500 + 7*frame, x, cells)
            call file%add_geometry(x, cells)
         end if
         call file%begin_frame(real(frame, wp), 0)
         call file%point_data('displacement', reshape([(known(frame, 1, i), i=1, size(x))], shape(x)))
         call file%cell_data('stress', reshape([(known(frame, 2, i), i=1, 6*size(cells, 2))], [6, size(cells, 2)]))
         call file%end_frame(error)
         if (allocated(error)) exit
         if (tell) write (output_unit, '(i0)') frame + 1
         if (tell) flush (output_unit)
      end do
      if (.not. tell) write (output_unit, '(a, i0)') 'frames finished: ', file%frame_count()
      call file%close(at_close)
   end subroutine write_many

   subroutine fill(kind, path, n, error)
      !> vtkhdf, h5, csv, dat or mac
      character(len=*), intent(in) :: kind
      character(len=*), intent(in) :: path
      !> most frames or rows
      integer, intent(in) :: n
      character(len=:), allocatable, intent(out) :: error
      select case (kind)
      case ('vtkhdf'); call fill_frames(path, n, error)
      case ('h5'); call fill_table(path, n, error)
      case default; call fill_text(kind, path, n, error)
      end select
   end subroutine fill

   subroutine fill_frames(path, n, error)
      character(len=*), intent(in) :: path
      integer, intent(in) :: n
      character(len=:), allocatable, intent(out) :: error
      type(vtkhdf_file_t) :: file
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: cells(:, :)
      integer :: frame
      call file%create(path, vtk_triangle, [vtkhdf_field('displacement', 3, real_64)], &
                       [vtkhdf_field('strength_factor')], error)
      call strip(2000, x, cells)
      do frame = 1, n
         if (allocated(error)) exit
         call random_number(x)
         call file%add_geometry(x, cells)
         call file%begin_frame(real(frame, wp), 0)
         call file%point_data('displacement', x)
         call file%cell_data('strength_factor', x(1, :size(cells, 2)))
         call file%end_frame(error)
      end do
      call file%discard()
   end subroutine fill_frames

   subroutine fill_table(path, n, error)
      character(len=*), intent(in) :: path
      integer, intent(in) :: n
      character(len=:), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(table_t) :: table
      integer :: i
      call file%create(path, error)
      if (.not. allocated(error)) call table%create(path//'.csv', file, '/table', &
                                                    [column('i', column_integer), column('x'), column('y')], error)
      if (.not. allocated(error)) call file%start_swmr(error)
      if (.not. allocated(error)) call table%start(file, error)
      do i = 1, n
         if (allocated(error)) exit
         call table%put(i); call table%put(i/3.0_wp); call table%put(i/7.0_wp)
         call table%end_row(file, error)
      end do
      call table%discard()
      call file%discard()
   end subroutine fill_table

   subroutine fill_text(kind, path, n, error)
      !> csv, dat or mac
      character(len=*), intent(in) :: kind
      character(len=*), intent(in) :: path
      integer, intent(in) :: n
      character(len=:), allocatable, intent(out) :: error
      type(csv_t) :: csv
      type(dat_t) :: dat
      type(apdl_t) :: mac
      real(wp), parameter :: u(2, 2) = 0.1_wp, s(6, 1) = 0.2_wp
      integer :: i
      select case (kind)
      case ('csv'); call csv%create(path, ['a', 'b'], error)
      case ('dat'); call dat%create(path, error)
      case default; call mac%create(path, 'full', error)
      end select
      if (kind == 'mac' .and. .not. allocated(error)) then
         call mac%begin_geometry([1, 2], u, [1], reshape([1, 2, 1], [3, 1]), [1], [.true.])
         call mac%end_geometry(error)
      end if
      do i = 1, n
         if (allocated(error)) exit
         select case (kind)
         case ('csv')
            call csv%put(i); call csv%put(i/3.0_wp)
            call csv%end_row(error)
         case ('dat'); call dat%node_table(dat_displacements, 'ALL', real(i, wp), [1, 2], u, error)
         case default; call mac%add_frame(real(i, wp), u, s, error)
         end select
      end do
      call csv%discard()
      call dat%discard()
      call mac%discard()
   end subroutine fill_text
end program write_samples
