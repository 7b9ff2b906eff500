!> How much memory a model needs and how much there is: so that one that is too large is an error, not a crash.
module rf_memory
   use rf_kinds, only: wp, i8
   use rf_text, only: to_text
   implicit none
   private
   public :: available_memory, memory_problem

   !> most that the program takes for an element when it reads a mesh and when it runs it [bytes]: measured with meshes of
   !> 0.25 to 10 million elements (240 and 640), rounded up. Growth by cracks comes on top
   integer(i8), parameter, public :: bytes_to_read = 250, bytes_to_run = 700
   real(wp), parameter :: giga = 1.0e9_wp

contains

   !> Memory that the program can still get [bytes]: what the system has left, or what is left up to the process's own limit
   !> (ulimit -v). The largest number where the system (Linux) does not say.
   integer(i8) function available_memory()
      integer(i8), parameter :: kilo = 1024
      integer(i8) :: limit, used
      available_memory = huge(available_memory)
      limit = number_in('/proc/meminfo', 'MemAvailable:')
      if (limit > 0) available_memory = kilo*limit
      limit = number_in('/proc/self/limits', 'Max address space')
      used = number_in('/proc/self/status', 'VmSize:')
      if (limit > 0 .and. used > 0) available_memory = min(available_memory, max(0_i8, limit - kilo*used))
   end function available_memory

   !> What to say where a mesh needs more memory than there is; unallocated if it does not.
   subroutine memory_problem(n_elements, bytes_each, purpose, problem)
      integer(i8), intent(in) :: n_elements
      !> bytes_to_read or bytes_to_run
      integer(i8), intent(in) :: bytes_each
      !> as in 'to be read'
      character(len=*), intent(in) :: purpose
      character(len=:), allocatable, intent(out) :: problem
      integer(i8) :: available
      available = available_memory()
      if (n_elements <= available/bytes_each) return
      problem = 'a mesh of '//to_text(n_elements)//' elements needs about '//gigabytes(bytes_each*real(n_elements, wp))// &
         ' GB of memory '//purpose//'; '//gigabytes(real(available, wp))//' GB are available'
   end subroutine memory_problem

   !> In GB, with one decimal.
   function gigabytes(bytes) result(text)
      real(wp), intent(in) :: bytes
      character(len=:), allocatable :: text
      character(len=20) :: number
      write (number, '(f20.1)') bytes/giga
      text = trim(adjustl(number))
   end function gigabytes

   !> First number behind a name at the beginning of a line of a file; 0 if there is none.
   integer(i8) function number_in(path, name)
      character(len=*), intent(in) :: path, name
      character(len=200) :: line
      integer :: unit, status
      number_in = 0
      open (newunit=unit, file=path, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, name) /= 1) cycle
         read (line(len(name) + 1:), *, iostat=status) number_in
         if (status /= 0) number_in = 0      ! 'unlimited'
         exit
      end do
      close (unit)
   end function number_in

end module rf_memory
