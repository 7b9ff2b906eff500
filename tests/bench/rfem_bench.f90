!> Measures parts of rfem on bodies of its own and prints lines `name value` (seconds, bytes, counts):
!>
!>    rfem_bench triad THREADS
!>    rfem_bench step ELEMENTS ORDERING THREADS [CRACKED|CROSSED|MIXED|GRAINS]
!>    rfem_bench look ELEMENTS THREADS
!>    rfem_bench event ELEMENTS EVENTS [CRACKED|CROSSED]
!>    rfem_bench growth ELEMENTS PERCENT
!>    rfem_bench memory ELEMENTS elastic|all
!>
!> The machine's other work can only slow down what is measured: of many windows the best one counts; on one thread
!> the processor's time is taken, on several the clock's.
program rfem_bench
   use, intrinsic :: iso_fortran_env, only: output_unit
   use omp_lib, only: omp_set_num_threads
   use rf_kinds, only: wp, i8, degree
   use rf_clock, only: monotonic_time, processor_time
   use rf_random, only: uniform
   use rf_criterion, only: max_rays, mode_tension
   use rf_criterion_cutoff, only: cutoff_t
   use rf_ray, only: split_t, split_limits_t, choose_split
   use rf_splitting, only: split_mesh
   use rf_step_k, only: lanes
   use rf_model, only: model_t
   use rf_renumber, only: renumbering_t
   use rf_snapshot, only: snapshot_t
   use bench_body, only: make_body, bend
   implicit none

   !> measured windows go on for so long [s], and there are so many at least
   real(wp), parameter :: patience = 3.0_wp
   integer, parameter :: least_windows = 3
   !> element updates of a window
   real(wp), parameter :: window_updates = 2.0e7_wp
   !> a tolerance that no relaxation reaches
   real(wp), parameter :: never = 1.0e-30_wp
   character(len=*), parameter :: item_name(10) = [character(len=10) :: 'topology', 'material', 'motion', 'loads', 'apply', &
                                                   'rows', 'contact', 'pieces', 'energy', 'failure']
   type(model_t), allocatable :: model
   integer :: threads = 1

   allocate (model)
   select case (word(1))
   case ('triad')
      threads = number(2)
      call omp_set_num_threads(threads)
      call measure_triad()
   case ('step')
      threads = number(4)
      call omp_set_num_threads(threads)
      call make_body(number(2), word(3), word(5), model)
      if (len(word(5)) > 0) then
         call measure_contact()
      else
         call measure_step()
      end if
   case ('look')
      threads = number(3)
      call omp_set_num_threads(threads)
      call make_body(number(2), 'HILBERT', '', model)
      call measure_look()
   case ('event')
      call omp_set_num_threads(1)
      call make_body(number(2), 'HILBERT', word(4), model)
      call measure_events(number(3))
   case ('growth')
      call omp_set_num_threads(1)
      call make_body(number(2), 'HILBERT', '', model)
      call measure_growth(0.01_wp*number(3))
   case ('memory')
      call measure_memory(number(2), word(3) == 'all')
   case default
      error stop 'rfem_bench: triad, step, look, event, growth or memory'
   end select

contains

   !> An argument of the command line.
   function word(place) result(text)
      integer, intent(in) :: place
      character(len=:), allocatable :: text
      character(len=20) :: buffer
      buffer = ''
      if (command_argument_count() >= place) call get_command_argument(place, buffer)
      text = trim(buffer)
   end function word

   integer function number(place)
      integer, intent(in) :: place
      character(len=20) :: buffer
      buffer = word(place)
      read (buffer, *) number
   end function number

   subroutine put(name, value)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      write (output_unit, '(a, 1x, es14.7)') name, value
   end subroutine put

   !> Time that counts: the processor's on one thread, else the clock's [s].
   real(wp) function time()
      if (threads == 1) then
         time = processor_time()
      else
         time = monotonic_time()
      end if
   end function time

   !> Bandwidth of a = b + s c: in half of the second-level caches, in what the third holds for all, in memory.
   subroutine measure_triad()
      integer, parameter :: n_sizes = 3
      character(len=*), parameter :: name(n_sizes) = [character(len=4) :: 'L2', 'L3', 'DRAM']
      real(wp), allocatable :: a(:), b(:), c(:)
      integer :: bytes(n_sizes), i, n, sweeps, sweep, k
      real(wp) :: best, start, end_of_patience
      bytes = [threads*524288, 12582912, 402653184]
      do i = 1, n_sizes
         n = bytes(i)/24
         sweeps = max(1, 100000000/n)
         allocate (a(n), b(n), c(n))
         !$omp parallel do schedule(static)
         do k = 1, n
            a(k) = 0
            b(k) = 1
            c(k) = k
         end do
         !$omp end parallel do
         best = huge(1.0_wp)
         end_of_patience = monotonic_time() + patience
         do while (monotonic_time() < end_of_patience)
            start = time()
            do sweep = 1, sweeps
               call triad(n, a, b, c, real(sweep, wp))
            end do
            best = min(best, time() - start)
         end do
         call put('bandwidth_'//trim(name(i)), 24.0_wp*n*sweeps/best)
         deallocate (a, b, c)
      end do
   end subroutine measure_triad

   subroutine triad(n, a, b, c, s)
      integer, intent(in) :: n
      real(wp), intent(inout) :: a(n)
      real(wp), intent(in) :: b(n), c(n), s
      integer :: k
      !$omp parallel do simd schedule(static) if (parallel: threads > 1)
      do k = 1, n
         a(k) = b(k) + s*c(k)
      end do
      !$omp end parallel do simd
   end subroutine triad

   !> Time of a complete relaxation step: windows of many steps, less what a relaxation costs beside its steps.
   subroutine measure_step()
      integer :: steps
      real(wp) :: many, none
      steps = max(20, min(2000, int(window_updates/model%mesh%n_elements)))
      call best_relaxation(1, none)
      call best_relaxation(steps + 1, many)
      call put('elements', real(model%mesh%n_elements, wp))
      call put('nodes', real(model%mesh%n_nodes, wp))
      call put('contact_nodes', real(model%contact%n_nodes, wp))
      call put('step', (many - none)/steps)
      call put('bytes_per_step', bytes_per_step())
   end subroutine measure_step

   !> Time of a step with contact, or of many materials, and of one of a body of the same size that is whole and of one material:
   !> windows in turn, so that what the machine does beside slows down both.
   subroutine measure_contact()
      type(model_t), allocatable :: whole
      integer :: steps, windows
      real(wp) :: best(2, 2), end_of_patience
      allocate (whole)
      call make_body(number(2), word(3), '', whole)
      steps = max(20, min(2000, int(window_updates/model%mesh%n_elements)))
      best = huge(1.0_wp)
      end_of_patience = monotonic_time() + 4*patience
      windows = 0
      do while (windows < least_windows .or. monotonic_time() < end_of_patience)
         call relax_once(model, 1, best(1, 1))
         call relax_once(whole, 1, best(1, 2))
         call relax_once(model, steps + 1, best(2, 1))
         call relax_once(whole, steps + 1, best(2, 2))
         windows = windows + 1
      end do
      call put('elements', real(model%mesh%n_elements, wp))
      call put('nodes', real(model%mesh%n_nodes, wp))
      call put('contact_nodes', real(model%contact%n_nodes, wp))
      call put('step', (best(2, 1) - best(1, 1))/steps)
      call put('whole_step', (best(2, 2) - best(1, 2))/steps)
      call put('bytes_per_step', bytes_per_step())
   end subroutine measure_contact

   !> Shortest time of relaxations of so many steps from rest.
   subroutine best_relaxation(steps, best)
      integer, intent(in) :: steps
      real(wp), intent(out) :: best
      integer :: windows
      real(wp) :: end_of_patience
      best = huge(1.0_wp)
      end_of_patience = monotonic_time() + patience
      windows = 0
      do while (windows < least_windows .or. monotonic_time() < end_of_patience)
         call relax_once(model, steps, best)
         windows = windows + 1
      end do
   end subroutine best_relaxation

   !> A relaxation of so many steps from rest.
   subroutine relax_once(body, steps, best)
      type(model_t), intent(inout) :: body
      integer, intent(in) :: steps
      !> shortest time so far [s]
      real(wp), intent(inout) :: best
      real(wp) :: start
      body%relaxation%settings%max_iterations = steps
      body%motion%ux = 0
      body%motion%uy = 0
      start = time()
      call body%equilibrate(never)
      best = min(best, time() - start)
   end subroutine relax_once

   !> What a step must move if caches hold what is used again and nothing else [bytes]: the entries of the rows once, of
   !> the node arrays u, w, v, f (two components) and 1/m, and p where forces act, with what is written read before, and
   !> the rows' nodes.
   real(wp) function bytes_per_step()
      integer :: b, entry_bytes, node_bytes
      integer(i8) :: entries
      entry_bytes = 4 + merge(4, 3, size(model%rows%kyx) > 0)*8
      node_bytes = (2 + 4 + 4 + 4 + merge(2, 0, size(model%loads%px) > 0) + 1)*8 + 4
      entries = 0
      do b = 1, model%rows%n_blocks
         entries = entries + model%rows%slice(size(model%rows%slice, 1), b) - model%rows%slice(1, b)
      end do
      bytes_per_step = real(entries*lanes*entry_bytes + int(model%mesh%n_nodes, i8)*node_bytes, wp)
   end function bytes_per_step

   !> A look at the criterion: in a beam that bends (few nodes come near the largest), and all over a body whose nodes are
   !> all alike, the dearest there is.
   subroutine measure_look()
      integer :: n
      call measure_step()
      call bend(model, 1.0e-4_wp)
      call put('look_bending', best_look())
      do n = 1, model%mesh%n_nodes
         model%motion%ux(n) = 1.0e-4_wp*model%mesh%x(1, n)
         model%motion%uy(n) = 0
      end do
      if (word(4) /= 'bend') call put('look_uniform', best_look())
   end subroutine measure_look

   real(wp) function best_look() result(best)
      real(wp) :: start, end_of_patience
      best = huge(1.0_wp)
      end_of_patience = monotonic_time() + patience
      do while (monotonic_time() < end_of_patience)
         start = time()
         call model%failure%look(model%mesh, model%material, model%motion)
         best = min(best, time() - start)
      end do
   end function best_look

   !> Split events at random nodes, half of them the newest, in random states of stress: the first half of them by
   !> model%split as a whole, the others item by item. Medians; the first event, which makes room in all arrays, apart.
   subroutine measure_events(events)
      integer, intent(in) :: events
      type(split_t) :: split
      real(wp), allocatable :: whole(:), item(:, :)
      real(wp) :: start
      integer :: i, n, draws
      allocate (whole(events), item(size(item_name), events))
      model%relaxation%settings%max_iterations = 3
      call model%equilibrate(never)
      call model%accept(.false.)
      draws = 0
      do i = 1, events
         call plan_at_random(draws, split)
         start = monotonic_time()
         call model%split(split, 1.0_wp, 1.0_wp)
         whole(i) = monotonic_time() - start
      end do
      call put('elements', real(model%mesh%n_elements, wp))
      call put('first', whole(1))
      call put('whole', median(whole(2:)))
      call put('whole_mean', sum(whole(2:))/(events - 1))
      call put('segments', real(model%mesh%n_segments, wp))
      call put('nodes', real(model%mesh%n_nodes, wp))
      call put('contact_nodes', real(model%contact%n_nodes, wp))
      call put('groups', real(model%contact%n_groups - model%contact%n_lone, wp))
      do i = 1, events
         call plan_at_random(draws, split)
         call split_by_items(split, item(:, i))
      end do
      do n = 1, size(item_name)
         call put('item_'//trim(item_name(n)), median(item(n, :)))
      end do
      call put('changed_elements', real(model%changes%n_elements, wp))
   end subroutine measure_events

   !> The step, without contact, of a body whose mesh has grown by splitting: before, after, and numbered anew.
   subroutine measure_growth(part)
      !> of the nodes that there were at first
      real(wp), intent(in) :: part
      type(split_t) :: split
      type(renumbering_t) :: map
      real(wp) :: start
      integer :: draws, nodes
      call put('elements', real(model%mesh%n_elements, wp))
      call put('updates', model%mesh%n_elements/elastic_step())
      nodes = model%mesh%n_nodes
      draws = 0
      do while (model%mesh%n_nodes < nodes*(1 + part))
         call plan_at_random(draws, split)
         call model%split(split, 1.0_wp, 1.0_wp)
      end do
      call put('grown_elements', real(model%mesh%n_elements, wp))
      call put('updates_grown', model%mesh%n_elements/elastic_step())
      start = monotonic_time()
      call model%renumber(map)
      call put('renumbering', monotonic_time() - start)
      call put('updates_renumbered', model%mesh%n_elements/elastic_step())
   end subroutine measure_growth

   !> Time of a step that leaves contact out [s].
   real(wp) function elastic_step()
      integer :: steps, pairs, lone, groups, nodes
      real(wp) :: many, none
      pairs = model%contact%n_pairs
      lone = model%contact%n_lone
      groups = model%contact%n_groups
      nodes = model%contact%n_nodes
      model%contact%n_pairs = 0
      model%contact%n_lone = 0
      model%contact%n_groups = 0
      model%contact%n_nodes = 0
      steps = max(20, min(2000, int(window_updates/model%mesh%n_elements)))
      call best_relaxation(1, none)
      call best_relaxation(steps + 1, many)
      elastic_step = (many - none)/steps
      model%contact%n_pairs = pairs
      model%contact%n_lone = lone
      model%contact%n_groups = groups
      model%contact%n_nodes = nodes
   end function elastic_step

   !> What model%split does, in its order.
   subroutine split_by_items(split, seconds)
      type(split_t), intent(in) :: split
      real(wp), intent(out) :: seconds(:)
      real(wp) :: t(0:size(item_name))
      t(0) = monotonic_time()
      model%events = model%events + 1
      call split_mesh(model%mesh, split, model%events, model%changes)
      t(1) = monotonic_time()
      call model%material%adopt(model%changes)
      t(2) = monotonic_time()
      call model%motion%adopt(model%changes)
      t(3) = monotonic_time()
      call model%loads%adopt(model%changes)
      t(4) = monotonic_time()
      call model%loads%follow(model%mesh, model%material, model%changes, 1.0_wp, 1.0_wp)
      t(5) = monotonic_time()
      call model%rows%update(model%mesh, model%material, model%changes)
      t(6) = monotonic_time()
      call model%contact%follow(model%mesh, model%material, model%motion, model%changes)
      t(7) = monotonic_time()
      call model%pieces%follow(model%mesh, model%changes)
      t(8) = monotonic_time()
      call model%energy%adopt(model%changes, model%loads, model%mesh%n_nodes)
      t(9) = monotonic_time()
      call model%failure%adopt(model%mesh, model%changes)
      t(10) = monotonic_time()
      seconds = t(1:) - t(:9)
   end subroutine split_by_items

   !> A split that a run could have chosen.
   subroutine plan_at_random(draws, split)
      integer, intent(inout) :: draws
      type(split_t), intent(out) :: split
      type(cutoff_t) :: law
      real(wp) :: ray(2, max_rays), stress(3)
      type(split_limits_t) :: limits
      integer :: node, n_rays, i, low
      do
         low = 0
         if (draw(draws) < 0.5_wp) low = max(0, model%mesh%n_nodes - 20)
         node = min(model%mesh%n_nodes, low + 1 + int((model%mesh%n_nodes - low)*draw(draws)))
         if (model%mesh%hinge(node)) cycle
         do i = 1, 3
            stress(i) = draw(draws) - 0.5_wp
         end do
         call law%directions(stress, tan(30*degree), mode_tension, ray, n_rays)
         call choose_split(model%mesh, node, ray(:, :n_rays), limits, model%failure%element_utilisation, &
                           model%failure%no_split_node, model%failure%no_split_element, split)
         if (split%node > 0) exit
      end do
      split%mode = mode_tension
   end subroutine plan_at_random

   !> The next random number.
   real(wp) function draw(draws)
      integer, intent(inout) :: draws
      draws = draws + 1
      draw = uniform(1, draws, 1)
   end function draw

   real(wp) function median(values)
      real(wp), intent(in) :: values(:)
      integer :: i
      median = 0
      do i = 1, size(values)
         if (count(values < values(i)) > size(values)/2) cycle
         median = max(median, values(i))
      end do
   end function median

   !> Memory per element of a body that is relaxed, elastic, or with all that a run may keep: cracks and pairs, criterion
   !> everywhere, the equilibria it may come back to.
   subroutine measure_memory(elements, everything)
      integer, intent(in) :: elements
      logical, intent(in) :: everything
      type(snapshot_t) :: last, before, beyond
      real(wp) :: empty
      empty = resident()
      model%failure%watching = everything
      call make_body(elements, 'HILBERT', trim(merge('CRACKED', '       ', everything)), model)
      model%relaxation%settings%max_iterations = 3
      call model%equilibrate(never)
      call put('elements', real(model%mesh%n_elements, wp))
      if (everything) then
         call model%failure%look_everywhere(model%mesh, model%material, model%motion)
         call last%take(model)
         call before%take(model)
         call beyond%take(model)
         call model%accept(.false.)
      end if
      call put('bytes_per_element', (resident() - empty)/model%mesh%n_elements)
      if (size(last%ux) < 0 .or. size(before%ux) + size(beyond%ux) < 0) return        ! all three live until here
   end subroutine measure_memory

   !> Memory of the process that is in use now [bytes].
   real(wp) function resident()
      character(len=80) :: line
      integer :: unit, status
      real(wp) :: kibibytes
      resident = 0
      open (newunit=unit, file='/proc/self/status', status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (line(:6) /= 'VmRSS:') cycle
         read (line(7:), *) kibibytes
         resident = 1024*kibibytes
         exit
      end do
      close (unit)
   end function resident

end program rfem_bench
