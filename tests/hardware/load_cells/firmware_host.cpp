// The microcontroller's program on a computer, before an HX711 that converts a known ramp.
// Prints what it sends; fails where PD_SCK is high while interrupts are on, or too long.

#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

enum { LOW, HIGH, INPUT, OUTPUT, FALLING };

static uint32_t now_us = 4294900000u;  // the clock wraps while it runs
static int pulses = 0;                 // since the last conversion was ready
static int clock_level = LOW;
static bool interrupts_on = true;
static uint32_t high_since = 0, ready_at = now_us;
static int32_t conversion = -3;
static int bit = 1;  // what DOUT holds
static void (*handler)() = nullptr;

static void fail(const char *why) {
  fprintf(stderr, "%s\n", why);
  exit(1);
}

uint32_t micros() { return now_us; }
void delayMicroseconds(uint32_t time) { now_us += time; }
void noInterrupts() { interrupts_on = false; }
void interrupts() { interrupts_on = true; }
void pinMode(int, int) {}
int digitalPinToInterrupt(int pin) { return pin; }
void attachInterrupt(int, void (*on_edge)(), int) { handler = on_edge; }
void detachInterrupt(int) { handler = nullptr; }

int digitalRead(int) {
  now_us += 1;
  if (pulses == 0 && bit == 1 && (int32_t)(now_us - ready_at) >= 0) {  // a conversion is ready
    bit = 0;
    if (handler) handler();
  }
  return bit;
}

void digitalWrite(int, int level) {
  if (level == HIGH && clock_level == LOW) {
    if (interrupts_on) fail("PD_SCK rises while interrupts are on");
    high_since = now_us;
    uint32_t word = (uint32_t)(conversion * 1000000) & 0xFFFFFF;
    pulses++;
    bit = pulses <= 24 ? word >> (24 - pulses) & 1 : 1;
  }
  if (level == LOW && clock_level == HIGH && now_us - high_since > 50)
    fail("PD_SCK is high for more than 50 us");
  if (level == LOW && pulses == 25) {  // 24 bits and the pulse of channel A at gain 128
    conversion++;
    pulses = 0;
    ready_at = now_us + 12400;
  }
  clock_level = level;
}

struct {
  void begin(long) {}
  int availableForWrite() { return 64; }
  void write(const uint8_t *data, int length) { fwrite(data, 1, length, stdout); }
  void printf(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
  }
} Serial;

#include PROGRAM

int main() {
  setup();
  while (conversion < 12) loop();
}
