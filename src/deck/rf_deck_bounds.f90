!> Bounds of a number: is it within, how are they told, what value is harmless when the user's was not.
module rf_deck_bounds
   use rf_kinds, only: wp
   use rf_text, only: to_text
   implicit none
   private
   public :: within, bounds_text, harmless

contains

   !> Whether a number keeps all bounds that are given.
   pure logical function within(value, above, below, at_least, at_most)
      !> the number
      real(wp), intent(in) :: value
      !> bounds that it must be beyond, or may also be equal to
      real(wp), intent(in), optional :: above, below, at_least, at_most
      within = .true.
      if (present(above)) within = within .and. value > above
      if (present(below)) within = within .and. value < below
      if (present(at_least)) within = within .and. value >= at_least
      if (present(at_most)) within = within .and. value <= at_most
   end function within

   !> 'above 0 and below 0.5'; empty without bounds.
   pure function bounds_text(above, below, at_least, at_most) result(text)
      !> as in within
      real(wp), intent(in), optional :: above, below, at_least, at_most
      character(len=:), allocatable :: text
      text = ''
      if (present(above)) text = 'above '//to_text(above)
      if (present(at_least)) text = 'at least '//to_text(at_least)
      if (len(text) > 0 .and. (present(below) .or. present(at_most))) text = text//' and '
      if (present(below)) text = text//'below '//to_text(below)
      if (present(at_most)) text = text//'at most '//to_text(at_most)
   end function bounds_text

   !> A number within the bounds.
   pure real(wp) function harmless(above, below, at_least, at_most) result(value)
      !> as in within
      real(wp), intent(in), optional :: above, below, at_least, at_most
      real(wp) :: least, most
      logical :: has_least, has_most
      has_least = present(above) .or. present(at_least)
      has_most = present(below) .or. present(at_most)
      least = 0
      most = 0
      if (present(above)) least = above
      if (present(at_least)) least = at_least
      if (present(below)) most = below
      if (present(at_most)) most = at_most
      value = 1
      if (has_least .and. has_most) value = 0.5_wp*least + 0.5_wp*most
      if (has_least .and. .not. has_most) value = merge(least, least + max(1.0_wp, abs(least)), present(at_least))
      if (has_most .and. .not. has_least) value = merge(most, most - max(1.0_wp, abs(most)), present(at_most))
   end function harmless

end module rf_deck_bounds
