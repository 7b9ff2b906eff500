!> The cohesive law of a crack that softens, for one pair of nodes: rigid up to its strength, then falling linearly with
!> the jump to zero, coming back along the secant (theory: eqs. 23a to 23e). Solved implicitly: the traction is that of the
!> jump at the end of the step.
module rf_cohesive_k
   use rf_kinds, only: wp
   implicit none
   private
   public :: cohesive_pair_t, solve_pair

   !> steps of the search for the jump; each at least halves the bracket
   integer, parameter :: max_steps = 60
   !> change of the separation, relative to it, at which it stands
   real(wp), parameter :: close_enough = 4*epsilon(1.0_wp)

   !> What a pair is asked about: all that its impulses follow from.
   type :: cohesive_pair_t
      !> jump that the pair would have without its own impulses, normal and tangential [length]
      real(wp) :: free(2) = 0
      !> jump that a unit impulse makes; 0 where both sides are held [length/impulse]
      real(wp) :: weight(2) = 0
      !> impulse of the full strength, tension and shear
      real(wp) :: cap(2) = 0
      !> jumps at which the traction has fallen to zero, opening and slip [length]
      real(wp) :: critical(2) = 0
      !> largest separation of any accepted state [-]
      real(wp) :: damage = 0
      !> the pair has just been born: it bears what holds it together
      logical :: rigid = .false.
      !> friction: coefficient [-], impulse borne besides while pressed, slip from which it is measured [length]
      real(wp) :: friction = 0, bond = 0, slip_reference = 0
   end type cohesive_pair_t

contains

   !> Impulses of a pair (normal positive pressing, tangential), the cohesive part of them, and the separation
   !> (0: the pair holds; 1 and more: nothing cohesive is left).
   pure subroutine solve_pair(pair, impulse, cohesive, separation)
      type(cohesive_pair_t), intent(in) :: pair
      real(wp), intent(out) :: impulse(2), cohesive(2), separation
      real(wp) :: share(2)
      impulse = 0
      cohesive = 0
      if (pair%rigid) then
         where (pair%weight > 0) impulse = -pair%free/pair%weight
         cohesive = [min(0.0_wp, impulse(1)), impulse(2)]
         separation = 0
         return
      end if
      if (pair%weight(1) > 0 .and. pair%free(1) <= 0) then
         impulse(1) = -pair%free(1)/pair%weight(1)
         call solve_pressed(pair, impulse(1), impulse(2), cohesive(2), separation)
         return
      end if
      call envelope(pair, pair%free, separation, share)
      where (pair%weight > 0) cohesive = -pair%free*(1 - share)/pair%weight
      impulse = cohesive
   end subroutine solve_pair

   !> A pair that is pressed: friction and the cohesion of mode II side by side.
   pure subroutine solve_pressed(pair, pressing, impulse, cohesive, separation)
      type(cohesive_pair_t), intent(in) :: pair
      !> normal impulse
      real(wp), intent(in) :: pressing
      !> tangential impulse, the cohesive part of it
      real(wp), intent(out) :: impulse, cohesive, separation
      real(wp) :: limit, needed, share(2), friction, free(2)
      impulse = 0
      cohesive = 0
      separation = abs(pair%free(2))/pair%critical(2)
      if (.not. pair%weight(2) > 0) return
      limit = pair%friction*pressing + pair%bond
      ! the cohesion at the slip from which friction is measured: can both hold it there?
      needed = (pair%slip_reference - pair%free(2))/pair%weight(2)
      separation = abs(pair%slip_reference)/pair%critical(2)
      if (separation <= 0 .and. pair%damage <= 0) then
         cohesive = max(-pair%cap(2), min(pair%cap(2), needed - max(-limit, min(limit, needed))))
      else
         cohesive = -pair%cap(2)*traction_ratio(max(separation, pair%damage))*pair%slip_reference/pair%critical(2)
      end if
      if (abs(needed - cohesive) <= limit) then
         impulse = needed
         return
      end if
      friction = sign(limit, needed - cohesive)
      free = [0.0_wp, pair%free(2) + pair%weight(2)*friction]
      call envelope(pair, free, separation, share)
      cohesive = -free(2)*(1 - share(2))/pair%weight(2)
      impulse = friction + cohesive
   end subroutine solve_pressed

   !> Traction at a separation, over strength times relative jump [-].
   pure real(wp) function traction_ratio(separation) result(ratio)
      real(wp), intent(in) :: separation
      ratio = max(0.0_wp, 1 - separation)/separation
   end function traction_ratio

   !> Separation of an open or slipping pair, and the parts of the free jump that are left of it: both components pull
   !> back with the same softened secant (theory: eq. 23e).
   pure subroutine envelope(pair, free, separation, share)
      type(cohesive_pair_t), intent(in) :: pair
      real(wp), intent(in) :: free(2)
      real(wp), intent(out) :: separation, share(2)
      real(wp) :: jump(2), stiff(2), low, high, f, slope, next
      integer :: i
      jump = free/pair%critical
      where (.not. pair%weight > 0) jump = 0
      stiff = max(tiny(1.0_wp), pair%weight*pair%cap/pair%critical)
      separation = pair%damage
      if (overshoot(separation) <= 0) then         ! the secant of the damage there is, or it holds
         share = part_at(separation)
         separation = norm2(jump*share)
         return
      end if
      if (norm2(jump) >= 1) then
         separation = norm2(jump)
         share = 1
         return
      end if
      low = pair%damage
      high = 1
      f = overshoot(low)
      do i = 1, max_steps
         slope = overshoot_slope(separation)
         next = 0.5_wp*(low + high)
         if (slope < 0) next = separation - f/slope
         if (.not. (next > low .and. next < high)) next = 0.5_wp*(low + high)
         if (abs(next - separation) <= close_enough*next) exit
         separation = next
         f = overshoot(separation)
         if (f > 0) then
            low = separation
         else
            high = separation
         end if
      end do
      share = part_at(separation)

   contains

      !> Part of the free jump that is left at a separation.
      pure function part_at(s) result(part)
         real(wp), intent(in) :: s
         real(wp) :: part(2)
         part = s/(stiff + (1 - stiff)*s)
      end function part_at

      !> How far the free jump is above what leaves a separation: H - 1, decreasing where the law has one solution. Its
      !> root is sought in 1 - 1/sqrt(H), which is linear in s where both components are equally stiff.
      pure real(wp) function overshoot(s)
         real(wp), intent(in) :: s
         overshoot = 1 - 1/max(tiny(1.0_wp), norm2(jump/(stiff + (1 - stiff)*s)))
      end function overshoot

      pure real(wp) function overshoot_slope(s)
         real(wp), intent(in) :: s
         real(wp) :: d(2), h
         d = stiff + (1 - stiff)*s
         h = sum((jump/d)**2)
         overshoot_slope = 0
         if (h > 0) overshoot_slope = -sum((jump/d)**2*(1 - stiff)/d)/(h*sqrt(h))
      end function overshoot_slope

   end subroutine envelope

end module rf_cohesive_k
