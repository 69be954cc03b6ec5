r"""The Transformer's fused kernel: one thread takes a few servos through the whole network.

Only what the last sample needs is computed, and nothing but samples, weights and forces goes
through memory:

- The input projection is linear and so are queries, keys and values of the first layer: each is a
  3-column matrix times the sample plus a constant of its place. A logit of the first layer is
  :math:`q_i \cdot (A_k s_j + c_{k,j}) = (A_k^T q_i) \cdot s_j + q_i \cdot c_{k,j}`, and the
  weighted mean of the values needs only the weighted means of the samples and of the constants.
- The second layer has one query, the last sample's. Keys and values are never formed:
  :math:`q \cdot (W_k y_i + b_k) = (W_k^T q) \cdot y_i + q \cdot b_k`, and the weighted mean of
  values is :math:`W_v` times that of :math:`y_i`, which is summed as the samples go by (Milakov and
  Gimelshein, Online normalizer calculation for softmax, 2018).

A thread's servos are lanes of a vector: eight on a CPU, where the compiler makes SIMD of them, one
on a GPU, where neighbouring threads are the lanes.
"""

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import DeviceArray, DeviceBlock, Placeholder, constant
from tendon_newton.device_code.templates import device_template


class Lane(Placeholder):
    """One number per servo of a thread."""


class Sample(Placeholder):
    """Three lanes: a sample."""


class FusedSamples(Placeholder):
    """Three times WINDOW lanes: all samples, the oldest first."""


class Token(Placeholder):
    """WIDTH lanes: an encoded sample."""


class Head(Placeholder):
    """DEPTH lanes: a head's share of a token."""


class Tokens(Placeholder):
    """HEADS times WIDTH lanes: a token per head."""


class Heads(Placeholder):
    """HEADS lanes: a number per head."""


class FirstLayer(Placeholder):
    """Eight lanes: the first layer of the perceptron at the end."""


class SecondLayer(Placeholder):
    """Four lanes: its second layer."""


LANES: int = constant()  # Servos of a thread
WINDOW: int = constant()  # Samples that the network sees
WIDTH: int = constant()  # Numbers in a token
HEADS: int = constant()  # Heads of an attention
DEPTH: int = constant()  # Numbers in a head's share of a token
FEED: int = constant()  # Units between the two layers behind an attention
CAUSAL: bool = constant()  # Whether a sample sees only those before it
AT_FEED_1: int = constant()
AT_FEED_1_BIAS: int = constant()
AT_FEED_2: int = constant()
AT_FEED_2_BIAS: int = constant()
AT_HEAD_1: int = constant()
AT_HEAD_1_BIAS: int = constant()
AT_HEAD_2: int = constant()
AT_HEAD_2_BIAS: int = constant()
AT_HEAD_3: int = constant()
AT_HEAD_3_BIAS: int = constant()
AT_INPUTS: int = constant()
AT_INPUTS_PLACE: int = constant()
AT_LAYER_1: int = constant()
AT_LAYER_2: int = constant()
AT_MIX: int = constant()
AT_MIX_BIAS: int = constant()
AT_NORM_1: int = constant()
AT_NORM_2: int = constant()
AT_PLACES: int = constant()
AT_SAMPLES: int = constant()
AT_SECOND: int = constant()
AT_SECOND_BIAS: int = constant()
# Where each block of numbers begins among the weights; see `fused_weights`
BLOCKS: dict[str, int] = {
    name.removeprefix("AT_").lower(): place
    for name, place in list(globals().items())
    if name.startswith("AT_")
}

NORM_FLOOR = 1.0e-5  # Added to a variance before its root, as `torch.nn.LayerNorm` does


@device_template
def lane_exp(x: Lane) -> Lane:
    """Return the exponential of each lane."""
    out = Lane()
    for lane in range(LANES):
        out[lane] = wp.exp(x[lane])
    return out


@device_template
def lane_inverse(x: Lane) -> Lane:
    """Return the inverse of each lane."""
    out = Lane()
    for lane in range(LANES):
        out[lane] = wp.float32(1.0) / x[lane]
    return out


@device_template
def plain(x: wp.float32) -> Lane:
    """Return one number in all lanes."""
    out = Lane()
    for lane in range(LANES):
        out[lane] = x
    return out


@device_template
def all_samples(
    ring: DeviceBlock[wp.float32], newest: DeviceArray[int], group: int, count: int
) -> FusedSamples:
    """Return the samples of the servos of a group, the oldest first."""
    out = FusedSamples()
    for lane in range(LANES):
        servo = wp.min(group * LANES + lane, count - 1)
        oldest = newest[servo] + 1
        for k in range(WINDOW):
            place = oldest + k
            if place >= WINDOW:
                place = place - WINDOW
            for c in range(3):
                out[3 * k + c, lane] = ring[place, c, servo]
    return out


@device_template
def normalised(w: DeviceArray[wp.float32], at: int, x: Token) -> Token:
    """Return a token with mean 0 and variance 1, times a gain, plus a bias."""
    mean = Lane()
    for i in range(WIDTH):
        mean = mean + x[i]
    mean = mean / wp.float32(WIDTH)
    variance = Lane()
    for i in range(WIDTH):
        variance = variance + wp.cw_mul(x[i] - mean, x[i] - mean)
    inverse = Lane()
    for lane in range(LANES):
        spread = variance[lane] / wp.float32(WIDTH) + wp.float32(NORM_FLOOR)
        inverse[lane] = wp.float32(1.0) / wp.sqrt(spread)
    out = Token()
    for i in range(WIDTH):
        out[i] = wp.cw_mul(x[i] - mean, inverse) * w[at + i] + plain(w[at + WIDTH + i])
    return out


@device_template
def mixed_and_fed(w: DeviceArray[wp.float32], at: int, x: Token, attended: Token) -> Token:
    """Return the rest of an encoder layer after its attention."""
    mixed = Token()
    for i in range(WIDTH):
        total = x[i] + plain(w[at + AT_MIX_BIAS + i])
        for j in range(WIDTH):
            total = total + attended[j] * w[at + AT_MIX + i * WIDTH + j]
        mixed[i] = total
    y = normalised(w, at + AT_NORM_1, mixed)
    fed = y
    for i in range(WIDTH):
        fed[i] = fed[i] + plain(w[at + AT_FEED_2_BIAS + i])
    for f in range(FEED):
        unit = plain(w[at + AT_FEED_1_BIAS + f])
        for i in range(WIDTH):
            unit = unit + y[i] * w[at + AT_FEED_1 + f * WIDTH + i]
        unit = wp.max(unit, Lane())
        for i in range(WIDTH):
            fed[i] = fed[i] + unit * w[at + AT_FEED_2 + f * WIDTH + i]
    return normalised(w, at + AT_NORM_2, fed)


@device_template
def logit(
    w: DeviceArray[wp.float32],
    probe: Sample,
    query: Head,
    first: Lane,
    second: Lane,
    third: Lane,
    key: int,
) -> Lane:
    """Return a logit of the first layer; `key` is where the key's constant of its place stands."""
    total = wp.cw_mul(probe[0], first)
    total = total + wp.cw_mul(probe[1], second)
    total = total + wp.cw_mul(probe[2], third)
    for e in range(DEPTH):
        total = total + query[e] * w[key + e]
    return total


@device_template
def attended_sample(w: DeviceArray[wp.float32], samples: FusedSamples, i: int) -> Token:
    """Return the first layer's attention of sample i, all heads."""
    seen = int(WINDOW)
    if wp.static(CAUSAL):
        seen = i + 1
    out = Token()
    for h in range(HEADS):
        query = Head()
        for e in range(DEPTH):
            row = h * DEPTH + e
            total = plain(w[AT_PLACES + i * 3 * WIDTH + row])
            for c in range(3):
                total = total + samples[3 * i + c] * w[AT_SAMPLES + row * 3 + c]
            query[e] = total
        probe = Sample()
        for c in range(3):
            total = Lane()
            for e in range(DEPTH):
                total = total + query[e] * w[AT_SAMPLES + (WIDTH + h * DEPTH + e) * 3 + c]
            probe[c] = total
        largest = plain(wp.float32(-1.0e30))
        for j in range(seen):
            key = AT_PLACES + j * 3 * WIDTH + WIDTH + h * DEPTH
            value = logit(
                w, probe, query, samples[3 * j], samples[3 * j + 1], samples[3 * j + 2], key
            )
            largest = wp.max(largest, value)
        total_weight = Lane()
        mean_sample = Sample()
        mean_place = Head()
        for j in range(seen):
            key = AT_PLACES + j * 3 * WIDTH + WIDTH + h * DEPTH
            value = logit(
                w, probe, query, samples[3 * j], samples[3 * j + 1], samples[3 * j + 2], key
            )
            weight = lane_exp(value - largest)
            total_weight = total_weight + weight
            for c in range(3):
                mean_sample[c] = mean_sample[c] + wp.cw_mul(weight, samples[3 * j + c])
            for e in range(DEPTH):
                mean_place[e] = mean_place[e] + weight * w[key + WIDTH + e]
        share = lane_inverse(total_weight)
        for e in range(DEPTH):
            row = 2 * WIDTH + h * DEPTH + e
            total = mean_place[e]
            for c in range(3):
                total = total + mean_sample[c] * w[AT_SAMPLES + row * 3 + c]
            out[h * DEPTH + e] = wp.cw_mul(total, share)
    return out


@device_template
def encoded_sample(w: DeviceArray[wp.float32], samples: FusedSamples, i: int) -> Token:
    """Return sample i after the first encoder layer."""
    x = Token()
    for k in range(WIDTH):
        total = plain(w[AT_INPUTS_PLACE + i * WIDTH + k])
        for c in range(3):
            total = total + samples[3 * i + c] * w[AT_INPUTS + k * 3 + c]
        x[k] = total
    attended = attended_sample(w, samples, i)
    return mixed_and_fed(w, AT_LAYER_1, x, attended)


@device_template
def last_probe(w: DeviceArray[wp.float32], y: Token) -> Tokens:
    """Return what the last sample's query asks of each encoded sample, per head."""
    probe = Tokens()
    for h in range(HEADS):
        for e in range(DEPTH):
            row = h * DEPTH + e
            query = plain(w[AT_SECOND_BIAS + row])
            for k in range(WIDTH):
                query = query + y[k] * w[AT_SECOND + row * WIDTH + k]
            for k in range(WIDTH):
                key = w[AT_SECOND + (WIDTH + row) * WIDTH + k]
                probe[h * WIDTH + k] = probe[h * WIDTH + k] + query * key
    return probe


@device_template
def perceptron(w: DeviceArray[wp.float32], y: Token) -> Lane:
    """Return the force [N] of the last sample's token."""
    first = FirstLayer()
    for i in range(8):
        total = plain(w[AT_HEAD_1_BIAS + i])
        for k in range(WIDTH):
            total = total + y[k] * w[AT_HEAD_1 + i * WIDTH + k]
        first[i] = wp.max(total, Lane())
    second = SecondLayer()
    for i in range(4):
        total = plain(w[AT_HEAD_2_BIAS + i])
        for k in range(8):
            total = total + first[k] * w[AT_HEAD_2 + i * 8 + k]
        second[i] = wp.max(total, Lane())
    out = plain(w[AT_HEAD_3_BIAS])
    for k in range(4):
        out = out + second[k] * w[AT_HEAD_3 + k]
    return out


@device_template
def transformer_kernel(
    ring: DeviceBlock[wp.float32],
    newest: DeviceArray[int],
    count: int,
    w: DeviceArray[wp.float32],
    limit: wp.float32,
    force: DeviceArray[wp.float32],
) -> None:
    """Write the forces [N] of one group of servos, no more than a limit."""
    group = int(wp.tid())  # pyright: ignore[reportArgumentType] - one dimension: a number
    samples = all_samples(ring, newest, group, count)
    newest_token = encoded_sample(w, samples, WINDOW - 1)
    probe = last_probe(w, newest_token)
    largest = Heads()
    weight_sum = Heads()
    mean = Tokens()
    for h in range(HEADS):
        largest[h] = plain(wp.float32(-1.0e30))
    for i in range(WINDOW):
        y = newest_token
        if i < WINDOW - 1:
            y = encoded_sample(w, samples, i)
        for h in range(HEADS):
            # a query's product with the keys' bias is the same for all: the softmax cancels it
            value = Lane()
            for k in range(WIDTH):
                value = value + wp.cw_mul(probe[h * WIDTH + k], y[k])
            highest = wp.max(largest[h], value)
            kept = lane_exp(largest[h] - highest)
            weight = lane_exp(value - highest)
            largest[h] = highest
            weight_sum[h] = wp.cw_mul(weight_sum[h], kept) + weight
            for k in range(WIDTH):
                before = wp.cw_mul(mean[h * WIDTH + k], kept)
                mean[h * WIDTH + k] = before + wp.cw_mul(weight, y[k])
    attended = Token()
    for h in range(HEADS):
        share = lane_inverse(weight_sum[h])
        for e in range(DEPTH):
            row = 2 * WIDTH + h * DEPTH + e
            total = Lane()
            for k in range(WIDTH):
                total = total + mean[h * WIDTH + k] * w[AT_SECOND + row * WIDTH + k]
            attended[h * DEPTH + e] = wp.cw_mul(total, share) + plain(w[AT_SECOND_BIAS + row])
    answer = perceptron(w, mixed_and_fed(w, AT_LAYER_2, newest_token, attended))
    for lane in range(LANES):
        servo = group * LANES + lane
        if servo < count:
            force[servo] = wp.min(answer[lane], limit)
