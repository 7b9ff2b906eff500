!> How long a frame of a large mesh takes: `bench_frames FILE N` writes frames of 2 N^2 triangles with the usual fields.
program bench_frames
   use, intrinsic :: iso_fortran_env, only: output_unit
   use rf_kinds, only: wp, i8
   use rf_vtkhdf, only: vtkhdf_file_t, vtkhdf_field, vtk_triangle, real_64, integer_32
   implicit none
   integer, parameter :: n_frames = 4
   type(vtkhdf_file_t) :: file
   character(len=:), allocatable :: error
   character(len=200) :: path, number
   real(wp), allocatable :: x(:, :), u(:, :), stress(:, :), cell_stress(:, :), noise(:)
   integer, allocatable :: cells(:, :), node_id(:), element_id(:)
   real(wp) :: seconds(0:n_frames)
   integer :: n, np, nc, i, j, k, frame

   call get_command_argument(1, path)
   call get_command_argument(2, number)
   read (number, *) n
   np = (n + 1)**2; nc = 2*n*n
   allocate (x(2, np), u(2, np), stress(6, np), cell_stress(6, nc), noise(nc), cells(3, nc), node_id(np), element_id(nc))
   do j = 0, n
      do i = 0, n
         x(:, j*(n + 1) + i + 1) = [real(i, wp), real(j, wp)]/n
      end do
   end do
   do j = 1, n
      do i = 1, n
         k = (j - 1)*(n + 1) + i
         cells(:, 2*((j - 1)*n + i) - 1) = [k, k + 1, k + n + 2]
         cells(:, 2*((j - 1)*n + i)) = [k, k + n + 2, k + n + 1]
      end do
   end do
   node_id = [(i, i=1, np)]; element_id = [(i, i=1, nc)]
   call random_number(noise)
   call file%create(trim(path), vtk_triangle, [vtkhdf_field('displacement', 3, real_64), vtkhdf_field('reaction', 3), &
                    vtkhdf_field('stress', 6), vtkhdf_field('sigma1'), vtkhdf_field('sigma3'), vtkhdf_field('utilisation'), &
                    vtkhdf_field('node_id', element=integer_32), vtkhdf_field('node_origin', element=integer_32)], &
                    [vtkhdf_field('stress', 6), vtkhdf_field('material', element=integer_32), &
                    vtkhdf_field('element_id', element=integer_32), vtkhdf_field('element_origin', element=integer_32), &
                    vtkhdf_field('split_level', element=integer_32), vtkhdf_field('fragment', element=integer_32), &
                    vtkhdf_field('strength_factor')], error)
   if (allocated(error)) error stop
   do frame = 1, n_frames
      ! a smooth field with scatter in the last third of the digits, as a relaxed solution has it
      u = sin(3*frame*x)*1.0e-3_wp
      do i = 1, np
         u(:, i) = u(:, i)*(1 + 1.0e-4_wp*noise(i))
         stress(:, i) = [x(1, i), x(2, i), 0.3_wp*x(1, i), x(1, i)*x(2, i), 0.0_wp, 0.0_wp]*1.0e6_wp*(1 + 0.01_wp*noise(i))
      end do
      do i = 1, nc
         cell_stress(:, i) = stress(:, cells(1, i))*(1 + 0.1_wp*noise(i))
      end do
      seconds(0) = wall()
      if (frame /= 2) call file%add_geometry(x, cells)
      call file%begin_frame(real(frame, wp), 0)
      call file%point_data('displacement', u)
      call file%point_data('reaction', 0*u)
      call file%point_data('stress', stress)
      call file%point_data('sigma1', stress(1, :))
      call file%point_data('sigma3', stress(2, :))
      call file%point_data('utilisation', abs(stress(4, :)))
      call file%cell_data('stress', cell_stress)
      if (frame /= 2) then
         call file%point_data('node_id', node_id)
         call file%point_data('node_origin', node_id)
         call file%cell_data('material', 0*element_id + 1)
         call file%cell_data('element_id', element_id)
         call file%cell_data('element_origin', element_id)
         call file%cell_data('split_level', 0*element_id)
         call file%cell_data('fragment', 0*element_id + 1)
         call file%cell_data('strength_factor', 1 + 0.02_wp*noise)
      end if
      call file%end_frame(error)
      if (allocated(error)) exit
      seconds(frame) = wall() - seconds(0)
      write (output_unit, '(a, i0, a, i0, a, f0.3, a, l1)') 'frame ', frame, ': ', nc, ' elements, ', seconds(frame), &
         ' s, with geometry: ', frame /= 2
   end do
   if (.not. allocated(error)) call file%close(error)
   if (allocated(error)) write (output_unit, '(a)') error

contains

   real(wp) function wall()
      integer(i8) :: count, rate
      call system_clock(count, rate)
      wall = real(count, wp)/real(rate, wp)
   end function wall
end program bench_frames
