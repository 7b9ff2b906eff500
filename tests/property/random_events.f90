!> Random sequences of events on random bodies: after each event every invariant of the mesh must hold (rf_invariants), and
!> everything attached to it must have followed (event_checks). A sequence is a function of its seed.
!>
!>    random_events --seed S [--runs N] [--only A[,B]..] [--trace]
!>
!> runs the sequences of the seeds S to S + N - 1 (N: 1). An event is an attempt that found something to split; what fails
!> is told with the number of its attempt, and the attempts up to that one are the smallest prefix that fails, as every
!> attempt is looked at. --only leaves out all attempts but those named (A, or a range A-B); the others stay as they are.
!> --trace names each attempt before it is made. ./run property makes a failing sequence as short as it can be.
program random_events
   use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
   use rf_kinds, only: wp, degree
   use rf_random, only: uniform
   use rf_criterion, only: max_rays, mode_tension, mode_shear
   use rf_criterion_cutoff, only: cutoff_t
   use rf_ray, only: split_t, split_limits_t, choose_split
   use rf_renumber, only: renumbering_t
   use rf_invariants, only: baseline_t, take_baseline, check_invariants
   use random_body, only: draws_t, body_t, make_body, shape_name, n_shapes
   use event_checks, only: state_t, take_state, check_event, check_anew
   use renumber_checks, only: renumber_and_check
   use test_meshes, only: smallest_angle
   implicit none

   !> attempts of a sequence; of one that goes on until nothing can split; in vain in a row, after which nothing can
   integer, parameter :: most_attempts = 60, attempts_to_the_end = 2000, in_vain = 60
   !> elements of the largest body that is split to its end, and of those of which less is asked
   integer, parameter :: small_body = 60, large_body = 1000, attempts_of_large = 15
   !> how often elements are taken out instead, and how often the mesh is numbered anew
   real(wp), parameter :: removals = 0.02_wp, renumberings = 0.02_wp

   !> what a sequence is asked for
   type :: sequence_t
      type(body_t) :: body
      type(baseline_t) :: baseline
      type(split_limits_t) :: limits
      integer :: seed = 0, attempts = 0
      !> it goes on until nothing can split
      logical :: to_the_end = .false.
   end type sequence_t

   integer :: first, runs, seed, done, kinds(4), removed, renumbered, ended, events_of(n_shapes), largest_mesh, most_events
   integer, allocatable :: only(:, :)
   logical :: trace
   real(wp) :: jump

   call read_arguments()
   done = 0
   kinds = 0
   removed = 0
   renumbered = 0
   ended = 0
   events_of = 0
   largest_mesh = 0
   most_events = 0
   jump = 0
   do seed = first, first + runs - 1
      call run_sequence(seed)
   end do
   write (output_unit, '(i0, a, i0, a, i0, a, i0, a, 6(i0, a))') done, ' random events in ', runs, ' sequences (seeds ', first, &
      ' to ', first + runs - 1, '): types I, II, III, edge ', kinds(1), ', ', kinds(2), ', ', kinds(3), ', ', kinds(4), &
      ', removals ', removed, ', new numbers ', renumbered, '; every invariant kept after each'
   write (output_unit, '(i0, a, i0, a, i0, a)') ended, ' sequences went on until nothing could split; the longest had ', &
      most_events, ' events, the largest mesh ', largest_mesh, ' elements'
   write (output_unit, '(a, es8.2)') 'largest jump of nodal forces over an event / largest force: ', jump

contains

   !> The command line; anything that is wrong there ends the program with the usage.
   subroutine read_arguments()
      character(len=2000) :: word, value
      integer :: i, status
      first = -1
      runs = 1
      trace = .false.
      allocate (only(2, 0))
      i = 1
      do while (i <= command_argument_count())
         call get_command_argument(i, word)
         if (word == '--trace') then
            trace = .true.
            i = i + 1
            cycle
         end if
         if (i == command_argument_count()) call usage()
         call get_command_argument(i + 1, value)
         status = 0
         select case (word)
         case ('--seed')
            read (value, *, iostat=status) first
         case ('--runs')
            read (value, *, iostat=status) runs
         case ('--only')
            call read_ranges(trim(value), status)
         case default
            status = 1
         end select
         if (status /= 0) call usage()
         i = i + 2
      end do
      if (first < 0 .or. runs < 1) call usage()
   end subroutine read_arguments

   !> Numbers and ranges with commas between them.
   subroutine read_ranges(text, status)
      character(len=*), intent(in) :: text
      integer, intent(out) :: status
      integer :: start, comma, dash, range(2)
      start = 1
      do
         comma = index(text(start:)//',', ',') + start - 1
         dash = index(text(start:comma - 1), '-')
         if (dash > 0) then
            read (text(start:start + dash - 2), *, iostat=status) range(1)
            if (status == 0) read (text(start + dash:comma - 1), *, iostat=status) range(2)
         else
            read (text(start:comma - 1), *, iostat=status) range(1)
            range(2) = range(1)
         end if
         if (status /= 0) return
         only = reshape([only, range], [2, size(only, 2) + 1])
         start = comma + 1
         if (start > len(text)) return
      end do
   end subroutine read_ranges

   subroutine usage()
      write (error_unit, '(a)') 'usage: random_events --seed S [--runs N] [--only A[,B-C]..] [--trace]'
      stop 2
   end subroutine usage

   !> The sequence of a seed.
   subroutine run_sequence(seed)
      integer, intent(in) :: seed
      type(sequence_t) :: sequence
      character(len=:), allocatable :: problem
      logical :: found
      integer :: attempt, vain
      if (trace) write (error_unit, '(a, i0, a)') 'seed ', seed, ', body'
      call begin(sequence, seed, problem)
      if (len(problem) > 0) call fail(sequence, 0, problem)
      vain = 0
      do attempt = 1, sequence%attempts
         if (vain >= in_vain) exit
         if (size(only, 2) > 0) then
            if (.not. any(only(1, :) <= attempt .and. attempt <= only(2, :))) cycle
         end if
         if (trace) write (error_unit, '(a, i0, a, i0)') 'seed ', seed, ', attempt ', attempt
         call make_attempt(sequence, attempt, found)
         vain = merge(0, vain + 1, found)
         if (sequence%body%model%mesh%n_elements < 2) exit
      end do
      if (sequence%to_the_end .and. vain >= in_vain) ended = ended + 1
      most_events = max(most_events, sequence%body%model%events)
      largest_mesh = max(largest_mesh, sequence%body%model%mesh%n_elements)
      events_of(sequence%body%shape) = events_of(sequence%body%shape) + sequence%body%model%events
   end subroutine run_sequence

   !> The body, and what may be done to it.
   subroutine begin(sequence, seed, problem)
      type(sequence_t), intent(out) :: sequence
      integer, intent(in) :: seed
      character(len=:), allocatable, intent(out) :: problem
      type(draws_t) :: draws
      sequence%seed = seed
      draws = draws_t(seed, -1, 0)
      call make_body(seed, sequence%body)
      call take_baseline(sequence%body%model%mesh, sequence%baseline)
      call check_invariants(sequence%body%model%mesh, sequence%baseline, problem)
      if (len(problem) == 0) call check_anew(sequence%body%model, problem)
      sequence%limits%max_level = draws%pick(5)
      if (draws%chance(0.3_wp)) sequence%limits%crack_angle = 0
      if (draws%chance(0.15_wp)) sequence%limits%smallest_angle = 3*degree
      sequence%limits%along_edges = draws%chance(0.15_wp)
      sequence%body%model%failure%settings%max_level = sequence%limits%max_level
      associate (n => sequence%body%model%mesh%n_elements)
         sequence%to_the_end = n <= small_body
         sequence%attempts = most_attempts
         if (sequence%to_the_end) sequence%attempts = attempts_to_the_end
         if (n > large_body) sequence%attempts = attempts_of_large
      end associate
   end subroutine begin

   !> One attempt: a split as a run would choose it, at a random node in a random state of stress; now and then one that the
   !> body itself asks for, a removal of elements, or new numbers for all there is.
   subroutine make_attempt(sequence, attempt, found)
      type(sequence_t), intent(inout) :: sequence
      integer, intent(in) :: attempt
      !> there was something to split, to remove or to number anew
      logical, intent(out) :: found
      type(draws_t) :: draws
      type(split_t) :: split
      real(wp) :: what
      draws = draws_t(sequence%seed, attempt, 0)
      what = draws%next()
      if (what < removals) then
         call remove_some(sequence, draws, attempt, found)
         return
      end if
      if (what < removals + renumberings) then
         call number_anew(sequence, attempt, found)
         return
      end if
      call shake_contact(sequence, draws)
      if (what < 0.2_wp) then
         call shake_body(sequence, draws)
         associate (model => sequence%body%model)
            call model%failure%look(model%mesh, model%material, model%motion)
            call model%failure%plan(model%mesh, model%material, split)
         end associate
      else
         call plan_at_random(sequence, draws, split)
      end if
      found = split%node > 0
      if (found) call split_and_check(sequence, split, attempt)
   end subroutine make_attempt

   !> Pairs know something that can be lost.
   subroutine shake_contact(sequence, draws)
      type(sequence_t), intent(inout) :: sequence
      type(draws_t), intent(inout) :: draws
      integer :: p
      real(wp) :: mark
      mark = draws%next()
      associate (contact => sequence%body%model%contact)
         do p = 1, contact%n_pairs
            contact%impulse(:, p) = mark*[p, -p]/contact%n_pairs
            contact%slip_reference(p) = mark/p
            contact%gap_reference(p) = -mark/(1 + p)
            contact%broken(p) = contact%broken(p) .or. mod(p, 3) == 0
         end do
      end associate
   end subroutine shake_contact

   !> Displacements like those of a stretched, sheared and disturbed body.
   subroutine shake_body(sequence, draws)
      type(sequence_t), intent(inout) :: sequence
      type(draws_t), intent(inout) :: draws
      real(wp) :: rate(2, 2)
      integer :: n
      do n = 1, 4
         rate(1 + mod(n, 2), 1 + (n - 1)/2) = 10*(draws%next() - 0.5_wp)
      end do
      associate (model => sequence%body%model)
         do n = 1, model%mesh%n_nodes
            model%motion%ux(n) = dot_product(rate(:, 1), model%mesh%x(:, n)) + 0.1_wp*uniform(draws%seed, n, draws%attempt + 1)
            model%motion%uy(n) = dot_product(rate(:, 2), model%mesh%x(:, n)) + 0.1_wp*uniform(draws%seed, n, draws%attempt + 2)
         end do
      end associate
   end subroutine shake_body

   !> A random node that may fail, by its place, so that it is the same one when other attempts are left out: any, or one of a
   !> crack.
   integer function node_by_place(sequence, draws) result(node)
      type(sequence_t), intent(in) :: sequence
      type(draws_t), intent(inout) :: draws
      real(wp) :: place(2), distance, nearest
      integer :: s, n, k, e, copies, wanted
      logical :: on_crack
      on_crack = draws%chance(0.6_wp)
      associate (mesh => sequence%body%model%mesh)
         place = [draws%next(), draws%next()]*1.02_wp*maxval(mesh%x(:, :mesh%n_nodes), 2)
         on_crack = on_crack .and. mesh%n_segments > 0
         node = 1
         nearest = huge(nearest)
         if (on_crack) then
            do s = 1, mesh%n_segments
               e = mesh%segment_element(1, s)
               do k = 1, 3
                  n = mesh%connectivity(k, e)
                  distance = norm2(mesh%x(:, n) - place)
                  if (distance < nearest) node = n
                  nearest = min(nearest, distance)
               end do
            end do
         else
            do n = 1, mesh%n_nodes
               distance = norm2(mesh%x(:, n) - place)
               if (distance < nearest) node = n
               nearest = min(nearest, distance)
            end do
         end if
         copies = 0
         wanted = draws%pick(4)
         place = mesh%x(:, node)
         do n = 1, mesh%n_nodes
            if (any(abs(mesh%x(:, n) - place) > 0)) cycle
            copies = copies + 1
            if (copies <= wanted) node = n
         end do
      end associate
   end function node_by_place

   subroutine plan_at_random(sequence, draws, split)
      type(sequence_t), intent(inout) :: sequence
      type(draws_t), intent(inout) :: draws
      type(split_t), intent(out) :: split
      type(cutoff_t) :: law
      real(wp), allocatable :: utilisation(:)
      real(wp) :: ray(2, max_rays), stress(3)
      integer :: node, n_rays, e, i, mode
      associate (model => sequence%body%model)
         node = node_by_place(sequence, draws)
         if (model%mesh%hinge(node) .or. model%failure%no_split_node(node)) return
         do i = 1, 3
            stress(i) = draws%next() - 0.5_wp
         end do
         if (draws%chance(0.2_wp)) stress(3) = 0       ! along the mesh's own lines
         mode = merge(mode_tension, mode_shear, draws%chance(0.5_wp))
         call law%directions(stress, tan(30*degree), int(mode, kind(mode_tension)), ray, n_rays)
         allocate (utilisation(model%mesh%n_elements))
         do e = 1, model%mesh%n_elements
            utilisation(e) = uniform(draws%seed, model%mesh%origin_of_element(e), draws%attempt + 1)
         end do
         call choose_split(model%mesh, node, ray(:, :n_rays), sequence%limits, utilisation, model%failure%no_split_node, &
                           model%failure%no_split_element, split)
         split%mode = int(mode, kind(mode_tension))
      end associate
   end subroutine plan_at_random

   !> Split, let everything follow, check all of it.
   subroutine split_and_check(sequence, split, attempt)
      type(sequence_t), intent(inout) :: sequence
      type(split_t), intent(in) :: split
      integer, intent(in) :: attempt
      type(state_t) :: before
      character(len=:), allocatable :: problem
      real(wp) :: least
      integer :: i
      call take_state(sequence%body%model, before)
      call sequence%body%model%split(split, 0.5_wp, 0.5_wp)
      call check_event(sequence%body, before, sequence%baseline, jump, problem)
      associate (model => sequence%body%model)
         least = min(sequence%body%angle, sequence%limits%smallest_angle, 12*degree) - 1.0e-9_wp
         do i = 1, model%changes%n_elements
            if (smallest_angle(model%mesh, model%changes%element(i)) < least) problem = 'a child is too thin'
            if (model%mesh%split_level(model%changes%element(i)) > sequence%limits%max_level) &
               problem = 'a child is too many generations down'
         end do
      end associate
      if (len(problem) > 0) call fail(sequence, attempt, problem, split)
      done = done + 1
      kinds(split%kind) = kinds(split%kind) + 1
   end subroutine split_and_check

   !> Take out elements, in a circle or anywhere.
   subroutine remove_some(sequence, draws, attempt, found)
      type(sequence_t), intent(inout) :: sequence
      type(draws_t), intent(inout) :: draws
      integer, intent(in) :: attempt
      logical, intent(out) :: found
      logical, allocatable :: gone(:)
      type(renumbering_t) :: map
      character(len=:), allocatable :: problem
      real(wp) :: centre(2), radius, often
      integer :: e
      logical :: anywhere
      associate (model => sequence%body%model)
         allocate (gone(model%mesh%n_elements))
         anywhere = draws%chance(0.3_wp)
         centre = [draws%next(), draws%next()]*maxval(model%mesh%x(:, :model%mesh%n_nodes), 2)
         radius = 0.2_wp*model%mesh%size*draws%next()
         often = 0.1_wp*draws%next()
         do e = 1, model%mesh%n_elements
            gone(e) = norm2(sum(model%mesh%x(:, model%mesh%connectivity(:, e)), 2)/3 - centre) < radius
            if (anywhere) gone(e) = uniform(draws%seed, e, draws%attempt + 3) < often
         end do
         found = any(gone) .and. .not. all(gone)
         if (.not. found) return
         call model%remove(gone, draws%chance(0.5_wp), map)
         call model%loads%apply(model%mesh, model%material, 0.5_wp, 0.5_wp)
         call take_baseline(model%mesh, sequence%baseline)
         call check_invariants(model%mesh, sequence%baseline, problem)
         if (len(problem) == 0) call check_anew(model, problem)
         if (len(problem) > 0) call fail(sequence, attempt, 'after a removal: '//problem)
         removed = removed + 1
         done = done + 1
      end associate
   end subroutine remove_some

   !> Number the mesh anew: the body of before in other numbers.
   subroutine number_anew(sequence, attempt, found)
      type(sequence_t), intent(inout) :: sequence
      integer, intent(in) :: attempt
      !> some node has another number
      logical, intent(out) :: found
      character(len=:), allocatable :: problem
      associate (model => sequence%body%model)
         call renumber_and_check(model, sequence%seed, attempt, found, problem)
         if (len(problem) == 0) call check_invariants(model%mesh, sequence%baseline, problem)
         if (len(problem) == 0) call check_anew(model, problem)
      end associate
      if (len(problem) > 0) call fail(sequence, attempt, 'after new numbers: '//problem)
      if (.not. found) return
      renumbered = renumbered + 1
      done = done + 1
   end subroutine number_anew

   !> Say what is wrong, with the smallest prefix and the command that shows it.
   subroutine fail(sequence, attempt, problem, split)
      type(sequence_t), intent(in) :: sequence
      integer, intent(in) :: attempt
      character(len=*), intent(in) :: problem
      type(split_t), intent(in), optional :: split
      write (error_unit, '(a, i0, a, i0, a, i0, 2a)') 'random_events: seed ', sequence%seed, ', attempt ', attempt, ', event ', &
         sequence%body%model%events, ': ', problem
      write (error_unit, '(3a, i0, a, i0, a)') '  body: ', trim(shape_name(sequence%body%shape)), ', ', &
         sequence%body%model%mesh%n_nodes, ' nodes, ', sequence%body%model%mesh%n_elements, ' elements'
      if (present(split)) write (error_unit, '(3(a, i0), 2(a, f12.9), a, f9.6, 2(a, i0))') '  node ', split%node, ', element ', &
         split%element, ', type ', split%kind, ', ray ', split%direction(1), ' ', split%direction(2), ', s ', split%s, &
         ', corners ', split%corner, ' ', split%second_corner
      error stop 1
   end subroutine fail

end program random_events
