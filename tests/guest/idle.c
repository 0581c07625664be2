// Preloaded into the guest's kernel (run.sh -v), to give it a time of its own: when everything in the guest waits, it
// is at once the time of the next timer; while something computes, time passes a hundredth as fast as outside. So
// whatever else this machine does, programs in the guest are in time, and waiting costs nothing.
//
// The kernel (arch/um/os-Linux/time.c) reads CLOCK_MONOTONIC, has one timer, which sends SIGALRM, and sleeps by
// sigsuspend(2) for it. The timer exists outside, too: it interrupts what computes.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>

#define SLOWER 100
#define SECOND 1000000000LL

static int64_t inside, outside;   // a moment: the guest's time, and this machine's
static int64_t due, period;       // the timer, in the guest's time; 0: off, once
static timer_t timer;

static void* real(const char* name) {
  void* function = dlsym(RTLD_NEXT, name);
  if (function == NULL) abort();
  return function;
}

static int64_t from_timespec(struct timespec t) { return t.tv_sec * SECOND + t.tv_nsec; }
static struct timespec to_timespec(int64_t t) { return (struct timespec){t / SECOND, t % SECOND}; }

static int real_time(clockid_t clock, struct timespec* time) {
  static int (*function)(clockid_t, struct timespec*);
  if (function == NULL) function = real("clock_gettime");
  return function(clock, time);
}

static int64_t now_outside(void) {
  struct timespec time;
  real_time(CLOCK_MONOTONIC, &time);
  return from_timespec(time);
}

static int64_t now_inside(void) {
  const int64_t now = now_outside();
  if (outside == 0) inside = outside = now;
  return inside + (now - outside) / SLOWER;
}

// Lets the machine's timer expire when the guest's does, if the guest computes until then.
static void set_timer(void) {
  static int (*function)(timer_t, int, const struct itimerspec*, struct itimerspec*);
  if (function == NULL) function = real("timer_settime");
  struct itimerspec setting = {};
  if (due != 0) {
    const int64_t left = (due - now_inside()) * SLOWER;
    setting.it_value = to_timespec(left > 0 ? left : 1);
    setting.it_interval = to_timespec(period * SLOWER);
  }
  function(timer, 0, &setting, NULL);
}

int clock_gettime(clockid_t clock, struct timespec* time) {
  if (clock != CLOCK_MONOTONIC) return real_time(clock, time);
  *time = to_timespec(now_inside());
  return 0;
}

int timer_settime(timer_t which, int flags, const struct itimerspec* setting, struct itimerspec* old) {
  (void)flags, (void)old;  // the kernel's are relative, and it does not ask
  timer = which;
  const int64_t value = from_timespec(setting->it_value);
  due = value == 0 ? 0 : now_inside() + value;
  period = from_timespec(setting->it_interval);
  set_timer();
  return 0;
}


int sigsuspend(const sigset_t* mask) {
  static int (*function)(const sigset_t*);
  if (function == NULL) function = real("sigsuspend");
  const int64_t now = now_inside();
  if (due != 0 && due <= now && period != 0) due = now + period;
  if (due > now) {
    inside = due;
    outside = now_outside();
    set_timer();  // expires at once
  }
  return function(mask);
}
