!> Reads `*AMPLITUDE`: the curves that supports and loads can follow.
module rf_amplitude_input
   use rf_kinds, only: wp
   use rf_amplitude, only: amplitude_t
   use rf_deck, only: deck_t, card_t, in_model
   use rf_deck_rules, only: name_table_t
   use rf_grow, only: grow
   use rf_text, only: to_text
   implicit none
   private
   public :: read_amplitudes

contains

   !> Read all curves.
   subroutine read_amplitudes(deck, names, amplitudes)
      type(deck_t), intent(inout) :: deck
      !> their names, in the same order
      type(name_table_t), intent(inout) :: names
      type(amplitude_t), allocatable, intent(out) :: amplitudes(:)
      type(card_t) :: card
      character(len=:), allocatable :: name
      allocate (amplitudes(deck%count_of('AMPLITUDE')))
      call deck%open(card, 'AMPLITUDE', where=in_model, about='a curve of factors over the step time: straight between its '// &
                     'points, constant outside them')
      do while (deck%next(card))
         call card%get_name('NAME', name, about='name of the curve')
         if (.not. card%describing()) call names%define(card, 'amplitude', name)
         if (card%describing()) then
            call describe_points(card)
         else
            call read_points(card, amplitudes(names%n))
            amplitudes(names%n)%name = name
         end if
      end do
      amplitudes = amplitudes(:names%n)
   end subroutine read_amplitudes

   subroutine describe_points(card)
      type(card_t), intent(inout) :: card
      real(wp) :: unused
      if (.not. card%needs_line('time, factor')) return
      call card%field_real('time', unused, unit='time', about='step time; times ascend. Any number of pairs on a line')
      call card%field_real('factor', unused, about='what the values are multiplied by')
   end subroutine describe_points

   !> The points of a curve, at least one; times ascend.
   subroutine read_points(card, amplitude)
      type(card_t), intent(inout) :: card
      type(amplitude_t), intent(inout) :: amplitude
      integer :: n, i
      n = 0
      if (card%needs_line('time, factor')) then
         do
            do i = 1, (card%fields() + 1)/2
               call grow(amplitude%time, n + 1)
               call grow(amplitude%factor, n + 1)
               call card%field_real('time', amplitude%time(n + 1), unit='time')
               call card%field_real('factor', amplitude%factor(n + 1))
               if (card%line_failed) exit
               n = n + 1
               if (n == 1) cycle
               if (amplitude%time(n) > amplitude%time(n - 1)) cycle
               call card%error('times must ascend: '//to_text(amplitude%time(n))//' does not come after '// &
                               to_text(amplitude%time(n - 1)))
               n = n - 1
               exit
            end do
            if (.not. card%line()) exit
         end do
      end if
      if (n == 0) then ! after an error: a curve all the same
         n = 1
         call grow(amplitude%time, n)
         call grow(amplitude%factor, n)
      end if
      amplitude%time = amplitude%time(:n)
      amplitude%factor = amplitude%factor(:n)
   end subroutine read_points
end module rf_amplitude_input
