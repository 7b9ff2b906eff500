!> Random numbers that are functions of their arguments alone: no state, so that a draw does not depend on the order
!> of drawing, on threads or on other draws. A draw is named by a seed, an id (of an element, a node) and a stream
!> (which of several draws for that id).
!>
!> Source: Threefry-2x32 with 20 rounds, J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers:
!> as easy as 1, 2, 3", SC11 (2011). It adds, rotates and xors 32-bit words; they are held in 64-bit integers here,
!> since a Fortran integer must not overflow.
module rf_random
   use rf_kinds, only: wp, i8, pi
   implicit none
   private
   public :: uniform, normal, weibull, threefry

   !> the 32 bits of a word
   integer(i8), parameter :: mask = int(z'FFFFFFFF', i8)
   !> the key schedule's parity word and the rotations of its rounds (Salmon et al., table 2)
   integer(i8), parameter :: parity = int(z'1BD11BDA', i8)
   integer, parameter :: rotation(8) = [13, 15, 26, 6, 17, 29, 16, 24]
   !> second key words: draws of different kinds never share bits
   integer(i8), parameter :: first_uniform = 1_i8, second_uniform = 2_i8
   !> bits that a uniform number is made of: k + 1/2 is exact, so that neither 0 nor 1 comes out
   integer, parameter :: fraction_bits = 52

contains

   !> Uniform on the open interval (0, 1).
   elemental real(wp) function uniform(seed, id, stream)
      !> the deck's seed; which element or node; which draw for it
      integer, intent(in) :: seed, id, stream
      uniform = uniform_of(seed, id, stream, first_uniform)
   end function uniform

   !> Normal with mean 0 and standard deviation 1 (Box & Muller 1958).
   elemental real(wp) function normal(seed, id, stream)
      !> the deck's seed; which element or node; which draw for it
      integer, intent(in) :: seed, id, stream
      normal = sqrt(-2*log(uniform_of(seed, id, stream, first_uniform))) &
               *cos(2*pi*uniform_of(seed, id, stream, second_uniform))
   end function normal

   !> Weibull of a given modulus, scaled to mean 1.
   elemental real(wp) function weibull(seed, id, stream, modulus)
      !> the deck's seed; which element or node; which draw for it
      integer, intent(in) :: seed, id, stream
      !> Weibull modulus m > 0 [-]
      real(wp), intent(in) :: modulus
      weibull = (-log(uniform(seed, id, stream)))**(1/modulus)/gamma(1 + 1/modulus)
   end function weibull

   !> Two words of the generator for a counter and a key of two words each (0 to 2^32 - 1).
   pure function threefry(counter, key) result(x)
      !> counter and key, 32-bit words
      integer(i8), intent(in) :: counter(2), key(2)
      integer(i8) :: x(2), schedule(0:2)
      integer :: round, injection
      schedule = [key(1), key(2), ieor(ieor(parity, key(1)), key(2))]
      x = iand(counter + schedule(0:1), mask)
      do round = 1, 20
         x(1) = iand(x(1) + x(2), mask)
         x(2) = ieor(rotated(x(2), rotation(mod(round - 1, 8) + 1)), x(1))
         if (mod(round, 4) /= 0) cycle
         injection = round/4
         x(1) = iand(x(1) + schedule(mod(injection, 3)), mask)
         x(2) = iand(x(2) + schedule(mod(injection + 1, 3)) + injection, mask)
      end do
   end function threefry

   !> A 32-bit word rotated to the left.
   pure integer(i8) function rotated(word, bits)
      !> the word
      integer(i8), intent(in) :: word
      !> places to go
      integer, intent(in) :: bits
      rotated = ior(iand(shiftl(word, bits), mask), shiftr(word, 32 - bits))
   end function rotated

   !> Uniform on (0, 1) from one of the two uses of a draw.
   elemental real(wp) function uniform_of(seed, id, stream, use)
      !> the deck's seed; which element or node; which draw for it
      integer, intent(in) :: seed, id, stream
      !> first_uniform or second_uniform
      integer(i8), intent(in) :: use
      integer(i8) :: x(2), k
      x = threefry([word_of(id), word_of(stream)], [word_of(seed), use])
      k = ior(shiftl(x(1), fraction_bits - 32), shiftr(x(2), 64 - fraction_bits))
      uniform_of = scale(real(k, wp) + 0.5_wp, -fraction_bits)
   end function uniform_of

   !> A default integer's 32 bits as a non-negative number.
   elemental integer(i8) function word_of(number)
      !> any integer
      integer, intent(in) :: number
      word_of = iand(int(number, i8), mask)
   end function word_of
end module rf_random
