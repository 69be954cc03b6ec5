// A Transformer over the last samples of servos: a warp takes one servo through the first layer and
// to the second's mixture of values, and then `SLOTS` servos together through what is left.
//
// The body of a device function; its arguments are `ring`, `newest`, `count`, `weights`, `limit`
// and `force`. All products of matrices run on tensor cores. Rows are samples (at the end, servos).
// Every product leaves a lane the numbers that the next one asks of it, in an order of columns that
// the weights are laid out for: of the tokens only the last passes through shared memory. The
// second layer has one query, the last sample's.
//
// The constants in capitals stand before this text: WINDOW samples (at most a warp's lanes) of
// WIDTH = 16 numbers, HEADS = 4 of DEPTH = 4, FEED units between the layers, and AT_..., where each
// block of numbers begins among the weights (see `fused_weights.py`).

constexpr int LANES = 32, SLOTS = 8, ROW = 2 * WIDTH + 4;
constexpr unsigned ALL = 0xffffffffu;
// the bits of a number that a tensor core reads, and half of what the last of them is worth
constexpr unsigned COARSE = 0xffffe000u, HALF = 0x1000u;
constexpr float NORM_FLOOR = 1.0e-5f;  // as torch.nn.LayerNorm
constexpr float LOG2_E = 1.4426950408889634f;
constexpr float UNSEEN = -1.0e30f;  // the logit of a sample that is not attended to
// where the blocks of each table begin
constexpr int QUERY = 0, KEY = 2, TOKEN = 4, VALUE = 6, OF_SAMPLES = 10;
constexpr int PLACE_QUERY = 0, PLACE_KEY = 4, PLACE_TOKEN = 8, PLACE_VALUE = 12, OF_PLACES = 20;
constexpr int MIX = 0, SECOND_VALUE = 4, FEED_1 = 8, FEED_2 = FEED_1 + FEED / 4;
constexpr int FACTORS = FEED_2 + FEED / 4;

// A product is 16 x 8 times 8 x 8. A lane holds of the left factor rows `row` and `row + 8` in
// column `pair`, then in column `pair + 4`; of the right one rows `pair` and `pair + 4` in column
// `row`; of the sum columns 2 `pair` and 2 `pair` + 1 in row `row`, then in `row + 8`. Factors have
// 11 bits, so each is a coarse part and what is left of it: three products are right to 2^-20.
using Two = float[2];
using Four = float[4];
struct Parts { float coarse, rest; };
struct Left { float coarse[4], rest[4]; };
struct __align__(16) Right { float coarse[2], rest[2]; };

__shared__ Right factors[FACTORS][LANES];
__shared__ float4 places[OF_PLACES][LANES];  // the constants of each sample's place
__shared__ Parts of_samples[OF_SAMPLES][LANES];
__shared__ float4 asks[2 * WIDTH / 4][LANES];
__shared__ float2 asks_bias[LANES];
__shared__ __align__(16) float norms[4 * WIDTH], feed_1_bias[FEED], feed_2_bias[WIDTH];
__shared__ __align__(16) float slots[WARPS][SLOTS][ROW];  // a servo's last token, its mixed values

const int lane = threadIdx.x % LANES, warp = threadIdx.x / LANES;
const int row = lane / 4, pair = lane % 4;
const float* w = static_cast<const float*>(__builtin_assume_aligned(weights.data, 16));

auto in_parts = [](float x) {
    Parts out;
    out.coarse = __uint_as_float((__float_as_uint(x) + HALF) & COARSE);
    out.rest = x - out.coarse;
    return out;
};
// The coarse part cut off in place of rounded: for what the loop below makes, one operation less.
auto cut = [](float x) { return __uint_as_float(__float_as_uint(x) & COARSE); };
auto one_part = [](float x, bool rest) {  // a tensor core reads no more of x than its coarse part
    return x - __uint_as_float(__float_as_uint(x) & (rest ? COARSE : 0u));
};
auto right = [&](float first, float second) {
    const Parts a = in_parts(first), b = in_parts(second);
    return Right{{a.coarse, b.coarse}, {a.rest, b.rest}};
};
auto left = [&](const Four& x, bool nearest = false) {  // of a sum of products
    Left out;
#pragma unroll
    for (int c = 0; c < 4; ++c) {
        const float coarse = nearest ? in_parts(x[c]).coarse : cut(x[c]);
        out.coarse[c % 2 * 2 + c / 2] = coarse;
        out.rest[c % 2 * 2 + c / 2] = x[c] - coarse;
    }
    return out;
};
auto multiply = [](Four& sum, float a0, float a1, float a2, float a3, float b0, float b1) {
    asm("mma.sync.aligned.m16n8k8.row.col.f32.tf32.tf32.f32 "
        "{%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, {%0, %1, %2, %3};"
        : "+f"(sum[0]), "+f"(sum[1]), "+f"(sum[2]), "+f"(sum[3])
        : "r"(__float_as_uint(a0)), "r"(__float_as_uint(a1)), "r"(__float_as_uint(a2)),
          "r"(__float_as_uint(a3)), "r"(__float_as_uint(b0)), "r"(__float_as_uint(b1)));
};
auto multiply_all = [&](Four& sum, const Four& a, const Two& b) {
    multiply(sum, a[0], a[1], a[2], a[3], b[0], b[1]);
};
auto add_product = [&](Four& sum, const Left& a, const Right& b) {
    multiply_all(sum, a.rest, b.coarse);
    multiply_all(sum, a.coarse, b.rest);
    multiply_all(sum, a.coarse, b.coarse);
};
// The same of factors with four columns and rows: `row` and `row` + 8 in column `pair`; row `pair`.
auto multiply_narrow = [](Four& sum, float a0, float a1, float b) {
    asm("mma.sync.aligned.m16n8k4.row.col.f32.tf32.tf32.f32 "
        "{%0, %1, %2, %3}, {%4, %5}, {%6}, {%0, %1, %2, %3};"
        : "+f"(sum[0]), "+f"(sum[1]), "+f"(sum[2]), "+f"(sum[3])
        : "r"(__float_as_uint(a0)), "r"(__float_as_uint(a1)), "r"(__float_as_uint(b)));
};
auto add_narrow = [&](Four& sum, const Parts& a0, const Parts& a1, const Parts& b) {
    multiply_narrow(sum, a0.rest, a1.rest, b.coarse);
    multiply_narrow(sum, a0.coarse, a1.coarse, b.rest);
    multiply_narrow(sum, a0.coarse, a1.coarse, b.coarse);
};
auto load = [](Four& out, const float4& from) {
    out[0] = from.x, out[1] = from.y, out[2] = from.z, out[3] = from.w;
};
auto pair_at = [](const float* from) {
    return *reinterpret_cast<const float2*>(from);
};
// The right factor whose columns are rows of a matrix of WIDTH columns.
auto right_of_rows = [&](const float* matrix, int tile, int half) {
    const float2 two = pair_at(matrix + (tile * 8 + row) * WIDTH + half * 8 + pair * 2);
    return right(two.x, two.y);
};
auto right_of_columns = [&](const float* matrix, int tile, int half) {
    const float* from = matrix + (tile * 8 + pair * 2) * WIDTH + half * 8 + row;
    return right(from[0], from[WIDTH]);
};

// All weights into the nearest cache, so that what follows waits for memory once.
for (int k = threadIdx.x * LANES; k < weights.shape[0]; k += blockDim.x * LANES)
    asm volatile("prefetch.global.L1 [%0];" : : "l"(w + k));
// The tables: each warp fills some of their blocks, each lane what it will read.
const float* layer_1 = w + AT_LAYER_1;
for (int k = warp; k < FACTORS; k += WARPS) {
    if (k < SECOND_VALUE) {
        const int number = k / 2 * 8 + pair * 2;  // two heads' numbers, two of each in a lane
        const float2 two = pair_at(layer_1 + AT_MIX + (k % 2 * 8 + row) * WIDTH + number);
        factors[k][lane] = right(two.x, two.y);
    } else if (k < FEED_1) {
        const int step = (k - SECOND_VALUE) / 2;
        factors[k][lane] = right_of_rows(w + AT_SECOND + 2 * WIDTH * WIDTH, k % 2, step);
    } else if (k < FEED_2) {
        const int step = k - FEED_1;
        factors[k][lane] = right_of_rows(layer_1 + AT_FEED_1, step / 2, step % 2);
    } else {
        const int step = k - FEED_2;
        factors[k][lane] = right_of_columns(layer_1 + AT_FEED_2, step / 2, step % 2);
    }
}
for (int k = warp; k < OF_PLACES; k += WARPS) {
    Four out;
#pragma unroll
    for (int c = 0; c < 4; ++c) {
        const int group = k / 2 % 2, half = k % 2;
        int place = half * 16 + c / 2 * 8 + row, from;
        if (k < PLACE_TOKEN) {
            const int number = (group * 2 + c % 2) * DEPTH + pair;
            from = AT_PLACES + place * 3 * WIDTH + (k < PLACE_KEY ? 0 : WIDTH) + number;
        } else if (k < PLACE_VALUE) {
            place = group * 16 + c / 2 * 8 + row;
            from = AT_INPUTS_PLACE + place * WIDTH + half * 8 + pair * 2 + c % 2;
        } else {
            const int number = ((k - PLACE_VALUE) / 4 * 2 + c / 2) * DEPTH + row % DEPTH;
            place = k % 4 * 8 + pair * 2 + c % 2;
            from = AT_PLACES + place * 3 * WIDTH + 2 * WIDTH + number;
        }
        out[c] = place < WINDOW ? w[from] : 0.0f;
        if (k < PLACE_KEY) out[c] *= LOG2_E;
        if (k >= PLACE_TOKEN && k < PLACE_VALUE)
            out[c] += layer_1[AT_MIX_BIAS + half * 8 + pair * 2 + c % 2];
    }
    places[k][lane] = float4{out[0], out[1], out[2], out[3]};
}
for (int k = warp; k < OF_SAMPLES; k += WARPS) {
    int from = AT_INPUTS + ((k - TOKEN) * 8 + row) * 3;
    if (k < TOKEN)
        from = AT_SAMPLES + (k / 2 * WIDTH + (k % 2 * 2 + row % 2) * DEPTH + row / 2) * 3;
    if (k >= VALUE) from = AT_SAMPLES + (2 * WIDTH + (k - VALUE) * DEPTH + row % DEPTH) * 3;
    const float number = pair < 3 ? w[from + pair] : 0.0f;
    of_samples[k][lane] = in_parts(k < KEY ? LOG2_E * number : number);
}
// What the last sample's query asks of each token, per head: a query's product with the keys' bias
// is the same for all, and the softmax cancels it. A lane has two numbers of a head's 16, and one
// part of each.
const int asked_head = row / 4 + row % 2 * 2, asked_part = row / 2 % 2;
for (int k = warp; k < 2 * WIDTH / 4 + 1; k += WARPS) {
    Four out = {};
#pragma unroll
    for (int c = 0; c < 4; ++c) {
        const bool bias = k == 2 * WIDTH / 4;
        const int second = bias ? c % 2 : k / (WIDTH / 4), number = k % (WIDTH / 4) * 4 + c;
#pragma unroll
        for (int e = 0; e < DEPTH; ++e) {
            const int at = asked_head * DEPTH + e;
            const float query = bias ? w[AT_SECOND_BIAS + at] : w[AT_SECOND + at * WIDTH + number];
            const int key = (WIDTH + at) * WIDTH + asked_part * 8 + pair * 2 + second;
            out[c] += LOG2_E * query * w[AT_SECOND + key];
        }
    }
    if (k < 2 * WIDTH / 4) asks[k][lane] = float4{out[0], out[1], out[2], out[3]};
    else asks_bias[lane] = float2{out[0], out[1]};
}
for (int k = threadIdx.x; k < 2 * WIDTH; k += blockDim.x) {
    norms[k] = layer_1[AT_NORM_1 + k];
    norms[2 * WIDTH + k] = layer_1[AT_NORM_2 + k];
}
for (int k = threadIdx.x; k < FEED; k += blockDim.x) feed_1_bias[k] = layer_1[AT_FEED_1_BIAS + k];
for (int k = threadIdx.x; k < WIDTH; k += blockDim.x) feed_2_bias[k] = layer_1[AT_FEED_2_BIAS + k];
__syncthreads();

// Sums over the lanes of a row, and over the rows.
auto over_pairs = [](float x) {
    x += __shfl_xor_sync(ALL, x, 1);
    return x + __shfl_xor_sync(ALL, x, 2);
};
auto over_rows = [](float x) {
    x += __shfl_xor_sync(ALL, x, 4);
    x += __shfl_xor_sync(ALL, x, 8);
    return x + __shfl_xor_sync(ALL, x, 16);
};
// 2^x, as the processor has it: to 2e-7, and 0 for what is smaller than a float's normal numbers.
auto power_of_two = [](float x) {
    float out;
    asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(out) : "f"(x));
    return out;
};
// Tokens with mean 0 and variance 1, times a gain, plus a bias.
auto normalised = [&](const float* gain_and_bias, Four (&x)[2]) {
#pragma unroll
    for (int half = 0; half < 4; half += 2) {
        const float mean = over_pairs(x[0][half] + x[0][half + 1] + x[1][half] + x[1][half + 1]);
        float variance = 0.0f;
#pragma unroll
        for (int k = 0; k < 4; ++k) {
            float& number = x[k / 2][half + k % 2];
            number -= mean * (1.0f / WIDTH);
            variance += number * number;
        }
        const float inverse = rsqrtf(over_pairs(variance) * (1.0f / WIDTH) + NORM_FLOOR);
#pragma unroll
        for (int n = 0; n < 2; ++n) {
            const float2 gain = pair_at(gain_and_bias + n * 8 + pair * 2);
            const float2 bias = pair_at(gain_and_bias + WIDTH + n * 8 + pair * 2);
            x[n][half] = x[n][half] * inverse * gain.x + bias.x;
            x[n][half + 1] = x[n][half + 1] * inverse * gain.y + bias.y;
        }
    }
};
// Adds what the units between the layers make of some tiles of 16 tokens.
auto add_fed = [&](auto& x, const float* first_bias, const float* second_bias, auto first,
                   auto second) {
    constexpr int TILES = sizeof(x) / sizeof(x[0]);
    Left tokens[TILES][2];
#pragma unroll
    for (int k = 0; k < TILES * 2; ++k) {
        Four& token = x[k / 2][k % 2];
        const float2 bias = pair_at(second_bias + k % 2 * 8 + pair * 2);
        tokens[k / 2][k % 2] = left(token);
        token[0] += bias.x, token[1] += bias.y, token[2] += bias.x, token[3] += bias.y;
    }
#pragma unroll 2
    for (int tile = 0; tile < FEED / 8; ++tile) {
        const float2 bias = pair_at(first_bias + tile * 8 + pair * 2);
        Four unit[TILES];
#pragma unroll
        for (int m = 0; m < TILES; ++m)
            unit[m][0] = bias.x, unit[m][1] = bias.y, unit[m][2] = bias.x, unit[m][3] = bias.y;
#pragma unroll
        for (int n = 0; n < 2; ++n) {
            const Right factor = first(tile, n);
#pragma unroll
            for (int m = 0; m < TILES; ++m) add_product(unit[m], tokens[m][n], factor);
        }
        Left units[TILES];
#pragma unroll
        for (int m = 0; m < TILES; ++m) {
#pragma unroll
            for (int c = 0; c < 4; ++c) unit[m][c] = fmaxf(unit[m][c], 0.0f);
            units[m] = left(unit[m]);
        }
#pragma unroll
        for (int n = 0; n < 2; ++n) {
            const Right factor = second(tile, n);
#pragma unroll
            for (int m = 0; m < TILES; ++m) add_product(x[m][n], units[m], factor);
        }
    }
};

// The second layer behind its attention and the perceptron: a row is a servo of `filled`.
auto answer = [&](int first_servo, int step, int filled) {
    const float* layer = w + AT_LAYER_2;
    const float* slot = slots[warp][row];
    Four x[1][2];
    __syncwarp();
#pragma unroll
    for (int n = 0; n < 2; ++n) {
        const float2 last = pair_at(slot + n * 8 + pair * 2);
        const float2 bias = pair_at(layer + AT_MIX_BIAS + n * 8 + pair * 2);
        x[0][n][0] = last.x + bias.x, x[0][n][1] = last.y + bias.y;
        x[0][n][2] = x[0][n][3] = 0.0f;
    }
#pragma unroll
    for (int k = 0; k < 2; ++k) {
        const float2 mixed = pair_at(slot + WIDTH + k * 8 + pair * 2);
        const float2 bias = pair_at(w + AT_SECOND_BIAS + 2 * WIDTH + k * 8 + pair * 2);
        const Four values = {mixed.x + bias.x, mixed.y + bias.y, 0.0f, 0.0f};
        const Left a = left(values, true);
#pragma unroll
        for (int n = 0; n < 2; ++n) add_product(x[0][n], a, right_of_rows(layer + AT_MIX, n, k));
    }
    normalised(layer + AT_NORM_1, x[0]);
    add_fed(
        x, layer + AT_FEED_1_BIAS, layer + AT_FEED_2_BIAS,
        [&](int tile, int n) { return right_of_rows(layer + AT_FEED_1, tile, n); },
        [&](int tile, int n) { return right_of_columns(layer + AT_FEED_2, tile, n); });
    normalised(layer + AT_NORM_2, x[0]);
    Four hidden = {w[AT_HEAD_1_BIAS + pair * 2], w[AT_HEAD_1_BIAS + pair * 2 + 1], 0.0f, 0.0f};
#pragma unroll
    for (int k = 0; k < 2; ++k)
        add_product(hidden, left(x[0][k], true), right_of_rows(w + AT_HEAD_1, 0, k));
    hidden[0] = fmaxf(hidden[0], 0.0f), hidden[1] = fmaxf(hidden[1], 0.0f);
    const float2 bias = pair_at(w + AT_HEAD_2_BIAS + pair % 2 * 2);
    const float2 from = pair_at(w + AT_HEAD_2 + row % 4 * 8 + pair * 2);
    Four second = {bias.x, bias.y, 0.0f, 0.0f};  // its four units twice
    add_product(second, left(hidden, true), right(from.x, from.y));
    const float2 last = pair_at(w + AT_HEAD_3 + pair % 2 * 2);
    float force_of_row = last.x * fmaxf(second[0], 0.0f) + last.y * fmaxf(second[1], 0.0f);
    force_of_row += __shfl_xor_sync(ALL, force_of_row, 1) + w[AT_HEAD_3_BIAS];
    if (pair == 0 && row < filled)
        force.data[first_servo + row * step] = fminf(force_of_row, limit);
};

const int step = gridDim.x * WARPS;
Four fetched;  // of samples `row`, `row` + 8 and so on, number `pair`; a servo's ahead of its turn
auto fetch = [&](int servo, int newest_place) {
#pragma unroll
    for (int t = 0; t < 4; ++t) {
        const int place = (newest_place + 1 + t * 8 + row) % WINDOW;
        fetched[t] = pair < 3 ? ring.data[size_t(place * 3 + pair) * ring.shape[2] + servo] : 0.0f;
    }
};
const int first = min(static_cast<int>(blockIdx.x) * WARPS + warp, count - 1);
fetch(first, newest.data[first]);
int filled = 0;
for (int servo = blockIdx.x * WARPS + warp; servo < count; servo += step) {
    const int next = min(servo + step, count - 1), newest_of_next = newest.data[next];
    Parts sample[4];
#pragma unroll
    for (int t = 0; t < 4; ++t) sample[t] = in_parts(fetched[t]);

    // The first layer's attention, two heads at once.
    Four x[2][2];
#pragma unroll
    for (int m = 0; m < 2; ++m) {
#pragma unroll
        for (int n = 0; n < 2; ++n) {
            load(x[m][n], places[PLACE_TOKEN + m * 2 + n][lane]);
            add_narrow(x[m][n], sample[m * 2], sample[m * 2 + 1], of_samples[TOKEN + n][lane]);
        }
    }
#pragma unroll 1
    for (int g = 0; g < 2; ++g) {
        Parts key[2][4];  // of a head; of samples `row`, `row` + 8 and so on, number `pair`
        float value[2][4][2];  // of samples 2 `pair` on, a part of number `row` % 4
#pragma unroll
        for (int m = 0; m < 2; ++m) {
            Four made;
            load(made, places[PLACE_KEY + g * 2 + m][lane]);
            add_narrow(made, sample[m * 2], sample[m * 2 + 1], of_samples[KEY + g][lane]);
#pragma unroll
            for (int c = 0; c < 4; ++c) key[c % 2][m * 2 + c / 2] = in_parts(made[c]);
        }
#pragma unroll
        for (int t = 0; t < 4; ++t) {
            const Parts a0 = of_samples[VALUE + g * 2][lane];
            const Parts a1 = of_samples[VALUE + g * 2 + 1][lane];
            Four made;
            load(made, places[PLACE_VALUE + g * 4 + t][lane]);
            add_narrow(made, a0, a1, sample[t]);
#pragma unroll
            for (int c = 0; c < 4; ++c) value[c / 2][t][c % 2] = one_part(made[c], row >= 4);
        }
#pragma unroll
        for (int m = 0; m < 2; ++m) {
            Four query, mean[2];
            float total[2][2];
            load(query, places[PLACE_QUERY + g * 2 + m][lane]);
            add_narrow(query, sample[m * 2], sample[m * 2 + 1], of_samples[QUERY + g][lane]);
#pragma unroll
            for (int h = 0; h < 2; ++h) {
                const Parts above = in_parts(query[h]), below = in_parts(query[2 + h]);
                float largest[2] = {UNSEEN, UNSEEN};
                Four weight[4];
#pragma unroll
                for (int t = 0; t < 4; ++t) {
#pragma unroll
                    for (int c = 0; c < 4; ++c) {
                        const int asking = m * 16 + c / 2 * 8 + row;
                        const int other = t * 8 + pair * 2 + c % 2;
                        const bool unseen = other >= WINDOW || (CAUSAL && other > asking);
                        weight[t][c] = unseen ? UNSEEN : 0.0f;
                    }
                    add_narrow(weight[t], above, below, key[h][t]);
#pragma unroll
                    for (int c = 0; c < 4; ++c)
                        largest[c / 2] = fmaxf(largest[c / 2], weight[t][c]);
                }
#pragma unroll
                for (int c = 0; c < 2; ++c) {
                    largest[c] = fmaxf(largest[c], __shfl_xor_sync(ALL, largest[c], 1));
                    largest[c] = fmaxf(largest[c], __shfl_xor_sync(ALL, largest[c], 2));
                    total[h][c] = 0.0f;
                    mean[h][c] = mean[h][2 + c] = 0.0f;
                }
#pragma unroll
                for (int t = 0; t < 4; ++t) {
#pragma unroll
                    for (int c = 0; c < 4; ++c) {
                        weight[t][c] = power_of_two(weight[t][c] - largest[c / 2]);
                        total[h][c / 2] += weight[t][c];
                    }
                    const Left a = left(weight[t]);
                    multiply_all(mean[h], a.rest, value[h][t]);
                    multiply_all(mean[h], a.coarse, value[h][t]);
                }
            }
            // Of the first head the lanes 0 and 1 of a row keep the sum of both parts, of the other
            // the lanes 2 and 3.
            const bool second = pair >= 2;
            Four mixed;
            float share[2];
#pragma unroll
            for (int c = 0; c < 2; ++c) {
                const float sent = __shfl_xor_sync(ALL, second ? total[0][c] : total[1][c], 2);
                const float both = (second ? total[1][c] : total[0][c]) + sent;
                share[c] = __fdividef(1.0f, both + __shfl_xor_sync(ALL, both, 1));
            }
#pragma unroll
            for (int c = 0; c < 4; ++c) {
                const float sent = __shfl_xor_sync(ALL, second ? mean[0][c] : mean[1][c], 2);
                mixed[c] = ((second ? mean[1][c] : mean[0][c]) + sent) * share[c / 2];
            }
            const Left a = left(mixed);
#pragma unroll
            for (int n = 0; n < 2; ++n) add_product(x[m][n], a, factors[MIX + g * 2 + n][lane]);
        }
    }

    // The rest of the first layer.
    fetch(next, newest_of_next);
    normalised(norms, x[0]);
    normalised(norms, x[1]);
    add_fed(
        x, feed_1_bias, feed_2_bias,
        [&](int tile, int n) { return factors[FEED_1 + tile * 2 + n][lane]; },
        [&](int tile, int n) { return factors[FEED_2 + tile * 2 + n][lane]; });
    normalised(norms + 2 * WIDTH, x[0]);
    normalised(norms + 2 * WIDTH, x[1]);

    // The second layer's attention.
    constexpr int LAST = WINDOW - 1;
    float* slot = slots[warp][filled];
    __syncwarp();
    if (row == LAST % 8) {
#pragma unroll
        for (int n = 0; n < 2; ++n) {
            const Four& from = x[LAST / 16][n];
            *reinterpret_cast<float2*>(slot + n * 8 + pair * 2)
                = float2{from[LAST / 8 % 2 * 2], from[LAST / 8 % 2 * 2 + 1]};
        }
    }
    __syncwarp();
    float asked[2] = {asks_bias[lane].x, asks_bias[lane].y};
#pragma unroll
    for (int k = 0; k < WIDTH / 4; ++k) {
        const float4 last = *reinterpret_cast<const float4*>(slot + 4 * k);
#pragma unroll
        for (int e = 0; e < 2; ++e) {
            const float4 ask = asks[e * (WIDTH / 4) + k][lane];
            asked[e] += ask.x * last.x + ask.y * last.y + ask.z * last.z + ask.w * last.w;
        }
    }
    float asks_of[2][2];  // a part of two numbers of each half of a token
#pragma unroll
    for (int e = 0; e < 2; ++e) {
        const float others = __shfl_xor_sync(ALL, asked[e], 8);
#pragma unroll
        for (int n = 0; n < 2; ++n)
            asks_of[n][e] = one_part(asked_part == n ? asked[e] : others, asked_part == 1);
    }
    Four logit[2] = {}, values[2][2] = {};
    float largest[2] = {UNSEEN, UNSEEN}, total[2] = {}, mixed[2][2] = {};
#pragma unroll
    for (int m = 0; m < 2; ++m) {
#pragma unroll
        for (int n = 0; n < 2; ++n) {
            const Left a = left(x[m][n]);
            multiply_all(logit[m], a.rest, asks_of[n]);
            multiply_all(logit[m], a.coarse, asks_of[n]);
#pragma unroll
            for (int k = 0; k < 2; ++k)
                add_product(values[m][k], a, factors[SECOND_VALUE + n * 2 + k][lane]);
        }
#pragma unroll
        for (int c = 0; c < 4; ++c) {
            logit[m][c] += __shfl_xor_sync(ALL, logit[m][c], 1);
            if (m * 16 + c / 2 * 8 + row >= WINDOW) logit[m][c] = UNSEEN;
            largest[c % 2] = fmaxf(largest[c % 2], logit[m][c]);
        }
    }
#pragma unroll
    for (int k = 0; k < 2; ++k) {  // a lane's heads
#pragma unroll
        for (int apart = 4; apart < LANES; apart *= 2)
            largest[k] = fmaxf(largest[k], __shfl_xor_sync(ALL, largest[k], apart));
#pragma unroll
        for (int j = 0; j < 4; ++j) {
            const float weight = power_of_two(logit[j / 2][j % 2 * 2 + k] - largest[k]);
            total[k] += weight;
            mixed[k][0] += weight * values[j / 2][k][j % 2 * 2];
            mixed[k][1] += weight * values[j / 2][k][j % 2 * 2 + 1];
        }
        const float share = __fdividef(1.0f, over_rows(total[k]));
        mixed[k][0] = over_rows(mixed[k][0]) * share;
        mixed[k][1] = over_rows(mixed[k][1]) * share;
        if (row == 0)
            *reinterpret_cast<float2*>(slot + WIDTH + k * 8 + pair * 2)
                = float2{mixed[k][0], mixed[k][1]};
    }
    ++filled;
    if (filled == SLOTS || servo + step >= count) {
        answer(servo - (filled - 1) * step, step, filled);
        filled = 0;
    }
}
