// HX711 to USB: one line per conversion, "L,<sequence>,<time_us>,<counts>*<CRC-8>\n".
//
// For an RP2040 (Raspberry Pi Pico) with the Arduino-Pico core; any Arduino with 3.3 V pins and
// micros() does. Wiring: DOUT to GP2, PD_SCK to GP3, VCC to 3V3, GND to GND, and the HX711's RATE
// pin to VCC for 80 conversions per second (many boards tie it to GND: 10 per second).
//
// A clock pulse of more than 50 us puts the HX711 to sleep or changes its gain (data sheet, table
// 3), so that nothing may interrupt while PD_SCK is high. That is why this runs here and not on the
// Raspberry Pi.

const int DATA_PIN = 2;
const int CLOCK_PIN = 3;
const int GAIN_PULSES = 1;  // after 24 data pulses: 1 gain 128, 3 gain 64 (2 is channel B, gain 32)
const int GAIN = GAIN_PULSES == 1 ? 128 : GAIN_PULSES == 3 ? 64 : 32;
const uint32_t SETTLED = 4;  // conversions after power-up or a change of gain that are not settled

uint32_t sequence = 0;
volatile uint32_t ready_us = 0;  // when the last conversion was ready

// DOUT falls when a conversion is ready. It also moves while bits are shifted out, so that this is
// attached only while waiting.
void onReady() { ready_us = micros(); }

// One clock pulse of about 1 us; returns the bit that DOUT then holds.
int pulse() {
  noInterrupts();
  digitalWrite(CLOCK_PIN, HIGH);
  delayMicroseconds(1);  // data sheet: data is valid 0.1 us after the rising edge
  digitalWrite(CLOCK_PIN, LOW);
  interrupts();
  delayMicroseconds(1);
  return digitalRead(DATA_PIN);
}

// Shift one conversion out, and choose channel and gain of the next one.
int32_t readCounts() {
  uint32_t value = 0;
  for (int bit = 0; bit < 24; bit++) value = value << 1 | pulse();
  for (int extra = 0; extra < GAIN_PULSES; extra++) pulse();
  return (int32_t)(value << 8) >> 8;  // 24-bit two's complement
}

// CRC-8: polynomial 0x07, start 0, nothing reflected.
uint8_t crc8(const char *data, int length) {
  uint8_t crc = 0;
  for (int i = 0; i < length; i++) {
    crc ^= (uint8_t)data[i];
    for (int bit = 0; bit < 8; bit++) crc = crc & 0x80 ? crc << 1 ^ 0x07 : crc << 1;
  }
  return crc;
}

void setup() {
  pinMode(DATA_PIN, INPUT);
  pinMode(CLOCK_PIN, OUTPUT);
  digitalWrite(CLOCK_PIN, LOW);  // high would keep the HX711 asleep
  Serial.begin(115200);          // over the RP2040's own USB the rate means nothing
  for (uint32_t k = 0; k < SETTLED; k++) {
    while (digitalRead(DATA_PIN)) {}
    readCounts();
  }
  ready_us = micros();
  Serial.printf("# tendon load cell, HX711, gain %d\n", GAIN);
  attachInterrupt(digitalPinToInterrupt(DATA_PIN), onReady, FALLING);
}

void loop() {
  if (digitalRead(DATA_PIN)) return;
  detachInterrupt(digitalPinToInterrupt(DATA_PIN));
  uint32_t time_us = ready_us;
  int32_t counts = readCounts();
  attachInterrupt(digitalPinToInterrupt(DATA_PIN), onReady, FALLING);

  char line[48];
  int length = snprintf(line, sizeof line, "L,%lu,%lu,%ld", (unsigned long)sequence++,
                        (unsigned long)time_us, (long)counts);
  length += snprintf(line + length, sizeof line - length, "*%02X\n", crc8(line, length));
  // A host that does not listen must not hold up the next conversion; the sequence shows the gap.
  if (Serial.availableForWrite() >= length) Serial.write((const uint8_t *)line, length);
}
