// A Transformer over the last samples of servos: a warp takes one servo through the network.
//
// The body of a device function; its arguments are `ring`, `newest`, `count`, `weights`, `limit` and
// `force`. In the first layer a lane is a sample; keys and values pass through shared memory, a head
// at a time, and what depends on a lane's own sample stays in its registers. The second layer has
// one query, the last sample's: there a lane is a row of the matrices. Samples, weights and forces
// are all that moves through the device's memory, and a block reads the weights once.
//
// The constants in capitals stand before this text: WINDOW samples (at most a warp's lanes) of
// WIDTH numbers, HEADS of DEPTH, FEED units between the layers, and AT_..., where each block of
// numbers begins among the weights (see `fused_weights.py`).

constexpr int LANES = 32, PAIRS = HEADS * WIDTH, ROW = WIDTH + 4;  // ROW: no two lanes on one bank
constexpr int FIRST_LAYER = AT_LAYER_2 - AT_LAYER_1, OWN = 4 * WIDTH;
constexpr unsigned ALL = 0xffffffffu;
constexpr float NORM_FLOOR = 1.0e-5f;  // as torch.nn.LayerNorm
constexpr float LOG2_E = 1.4426950408889634f;
constexpr float UNSEEN = -1.0e30f;  // the logit of a sample that is not attended to

using Token = float[WIDTH];

struct Scratch {  // of a warp
    union {
        struct { float4 key[WINDOW], value[WINDOW]; } head;
        float token[LANES][ROW];
    };
    float pairs[PAIRS], share[HEADS][LANES], row[WIDTH], unit[FEED];
};
__shared__ __align__(16) float first_layer[FIRST_LAYER];
__shared__ __align__(16) float inputs[3 * WIDTH], samples[9 * WIDTH];
__shared__ float own[OWN][LANES];  // the constants of a lane's place: query, key, value, token
__shared__ Scratch scratches[WARPS];

const int lane = threadIdx.x % LANES, warp = threadIdx.x / LANES;
const int seen = CAUSAL ? lane + 1 : WINDOW;  // samples that this lane's sample attends to
Scratch& scratch = scratches[warp];
const float* w = static_cast<const float*>(__builtin_assume_aligned(weights.data, 16));

for (int k = threadIdx.x; k < FIRST_LAYER; k += blockDim.x) first_layer[k] = w[AT_LAYER_1 + k];
__syncthreads();
for (int k = threadIdx.x; k < FEED * WIDTH; k += blockDim.x) {
    // in the order in which lanes take them for a product of matrices: unit, number of the token
    const int half = k % 2, at = k / 2 % LANES, tile = k / (2 * LANES) / 2, step = k / (2 * LANES) % 2;
    const int unit = tile * 8 + at / 4, number = step * 8 + at % 4 + half * 4;
    first_layer[AT_FEED_1 + k] = w[AT_LAYER_1 + AT_FEED_1 + unit * WIDTH + number];
    const int asked = tile * 8 + at % 4 * 2 + half, made = step * 8 + at / 4;
    first_layer[AT_FEED_2 + k] = w[AT_LAYER_1 + AT_FEED_2 + asked * WIDTH + made];
}
for (int k = threadIdx.x; k < 3 * WIDTH; k += blockDim.x) inputs[k] = w[AT_INPUTS + k];
for (int k = threadIdx.x; k < 9 * WIDTH; k += blockDim.x) samples[k] = w[AT_SAMPLES + k];
for (int k = threadIdx.x; k < OWN * WINDOW; k += blockDim.x) {
    const int place = k / OWN, row = k % OWN;
    own[row][place] = row < 3 * WIDTH ? w[AT_PLACES + place * 3 * WIDTH + row]
                                      : w[AT_INPUTS_PLACE + place * WIDTH + row - 3 * WIDTH];
}
__syncthreads();

// A token with mean 0 and variance 1, times a gain, plus a bias.
auto normalised = [&](const float* gain_and_bias, Token& x) {
    float mean = 0.0f, variance = 0.0f;
#pragma unroll
    for (int i = 0; i < WIDTH; ++i) mean += x[i];
    mean *= 1.0f / WIDTH;
#pragma unroll
    for (int i = 0; i < WIDTH; ++i) variance += (x[i] - mean) * (x[i] - mean);
    const float inverse = rsqrtf(variance * (1.0f / WIDTH) + NORM_FLOOR);
#pragma unroll
    for (int i = 0; i < WIDTH; ++i)
        x[i] = (x[i] - mean) * inverse * gain_and_bias[i] + gain_and_bias[WIDTH + i];
};
// The same where lane i has number i, twice in a warp.
auto normalised_row = [&](const float* gain_and_bias, float x) {
    const int i = lane % WIDTH;
    float mean = x;
#pragma unroll
    for (int step = WIDTH / 2; step > 0; step /= 2) mean += __shfl_xor_sync(ALL, mean, step);
    const float apart = x - mean * (1.0f / WIDTH);
    float variance = apart * apart;
#pragma unroll
    for (int step = WIDTH / 2; step > 0; step /= 2) variance += __shfl_xor_sync(ALL, variance, step);
    return apart * rsqrtf(variance * (1.0f / WIDTH) + NORM_FLOOR) * gain_and_bias[i]
        + gain_and_bias[WIDTH + i];
};
// 2^x, as the processor has it: to 2e-7, and 0 for what is smaller than a float's normal numbers.
auto power_of_two = [](float x) {
    float out;
    asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(out) : "f"(x));
    return out;
};
auto product = [](const float* row, const float* x) {
    float total = 0.0f;
#pragma unroll
    for (int k = 0; k < WIDTH; ++k) total += row[k] * x[k];
    return total;
};

// Products of matrices on tensor cores, 16 x 8 times 8 x 8 at once. Their factors have 11 bits, so
// each is a coarse part and what is left of it; three products of parts are right to 2^-21.
using Four = float[4];
struct Parts { unsigned coarse, rest; };
auto in_parts = [](float x) {
    Parts out;
    asm("cvt.rna.tf32.f32 %0, %1;" : "=r"(out.coarse) : "f"(x));
    asm("cvt.rna.tf32.f32 %0, %1;" : "=r"(out.rest) : "f"(x - __uint_as_float(out.coarse)));
    return out;
};
auto add_product = [](Four& sum, const Parts (&a)[4], const Parts (&b)[2]) {
    auto once = [&](unsigned a0, unsigned a1, unsigned a2, unsigned a3, unsigned b0, unsigned b1) {
        asm("mma.sync.aligned.m16n8k8.row.col.f32.tf32.tf32.f32 "
            "{%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, {%0, %1, %2, %3};"
            : "+f"(sum[0]), "+f"(sum[1]), "+f"(sum[2]), "+f"(sum[3])
            : "r"(a0), "r"(a1), "r"(a2), "r"(a3), "r"(b0), "r"(b1));
    };
    once(a[0].rest, a[1].rest, a[2].rest, a[3].rest, b[0].coarse, b[1].coarse);
    once(a[0].coarse, a[1].coarse, a[2].coarse, a[3].coarse, b[0].rest, b[1].rest);
    once(a[0].coarse, a[1].coarse, a[2].coarse, a[3].coarse, b[0].coarse, b[1].coarse);
};
// What the units between the layers add to each lane's token, and the token itself. Rows of the
// matrices are samples; a lane holds rows `row` and `row + 8` of each half, columns `pair` on.
auto feed_forward = [&](const Token& x, Token& out) {
    const int row = lane / 4, pair = lane % 4;
    __syncwarp();
#pragma unroll
    for (int k = 0; k < WIDTH; ++k) scratch.token[lane][k] = x[k];
    __syncwarp();
    Parts tokens[2][2][4];  // of a half of the samples and of the numbers
    Four sums[2][2] = {};
#pragma unroll
    for (int m = 0; m < 2; ++m) {
#pragma unroll
        for (int k = 0; k < 8; ++k)
            tokens[m][k / 4][k % 4] = in_parts(
                scratch.token[16 * m + row + k % 2 * 8][k / 4 * 8 + pair + k / 2 % 2 * 4]);
    }
#pragma unroll 2
    for (int tile = 0; tile < FEED / 8; ++tile) {
        Parts first[2][2], second[2][2];
#pragma unroll
        for (int step = 0; step < 2; ++step) {
            const int at = ((tile * 2 + step) * LANES + lane) * 2;
#pragma unroll
            for (int half = 0; half < 2; ++half) {
                first[step][half] = in_parts(first_layer[AT_FEED_1 + at + half]);
                second[step][half] = in_parts(first_layer[AT_FEED_2 + at + half]);
            }
        }
        const float* bias = first_layer + AT_FEED_1_BIAS + tile * 8 + pair * 2;
#pragma unroll
        for (int m = 0; m < 2; ++m) {
            Four unit = {bias[0], bias[1], bias[0], bias[1]};
            add_product(unit, tokens[m][0], first[0]);
            add_product(unit, tokens[m][1], first[1]);
            Parts units[4];  // columns 0, 2, 4, 6, then 1, 3, 5, 7: the second's rows stand alike
#pragma unroll
            for (int k = 0; k < 4; ++k) units[k % 2 * 2 + k / 2] = in_parts(fmaxf(unit[k], 0.0f));
            add_product(sums[m][0], units, second[0]);
            add_product(sums[m][1], units, second[1]);
        }
    }
    __syncwarp();
#pragma unroll
    for (int m = 0; m < 2; ++m) {
#pragma unroll
        for (int k = 0; k < 8; ++k)
            scratch.token[16 * m + row + k / 2 % 2 * 8][k / 4 * 8 + pair * 2 + k % 2]
                = sums[m][k / 4][k % 4];
    }
    __syncwarp();
#pragma unroll
    for (int i = 0; i < WIDTH; ++i)
        out[i] = x[i] + first_layer[AT_FEED_2_BIAS + i] + scratch.token[lane][i];
};

for (int servo = blockIdx.x * WARPS + warp; servo < count; servo += gridDim.x * WARPS) {
    float sample[3];
    Token x, token;
    const int place = (newest.data[servo] + 1 + lane) % WINDOW;
#pragma unroll
    for (int c = 0; c < 3; ++c)
        sample[c] = ring.data[size_t(place * 3 + c) * ring.shape[2] + servo];

    // The first layer's attention.
    auto projected = [&](int row) {
        const float* s = samples + 3 * row;
        return own[row][lane] + s[0] * sample[0] + s[1] * sample[1] + s[2] * sample[2];
    };
#pragma unroll
    for (int h = 0; h < HEADS; ++h) {
        __syncwarp();
        if (lane < WINDOW) {
            float* key = reinterpret_cast<float*>(&scratch.head.key[lane]);
            float* value = reinterpret_cast<float*>(&scratch.head.value[lane]);
#pragma unroll
            for (int e = 0; e < DEPTH; ++e) {
                key[e] = projected(WIDTH + h * DEPTH + e);
                value[e] = projected(2 * WIDTH + h * DEPTH + e);
            }
        }
        __syncwarp();
        float query[DEPTH], logit[WINDOW], mean[DEPTH] = {}, total = 0.0f, largest = UNSEEN;
#pragma unroll
        for (int e = 0; e < DEPTH; ++e) query[e] = LOG2_E * projected(h * DEPTH + e);
#pragma unroll
        for (int j = 0; j < WINDOW; ++j) {
            const float4 key = scratch.head.key[j];
            const float likeness =
                query[0] * key.x + query[1] * key.y + query[2] * key.z + query[3] * key.w;
            logit[j] = j < seen ? likeness : UNSEEN;
            largest = fmaxf(largest, logit[j]);
        }
#pragma unroll
        for (int j = 0; j < WINDOW; ++j) {
            const float4 value = scratch.head.value[j];
            const float weight = power_of_two(logit[j] - largest);
            total += weight;
            mean[0] += weight * value.x;
            mean[1] += weight * value.y;
            mean[2] += weight * value.z;
            mean[3] += weight * value.w;
        }
        const float share = 1.0f / total;
#pragma unroll
        for (int e = 0; e < DEPTH; ++e) token[h * DEPTH + e] = mean[e] * share;
    }

    // The rest of the first layer.
#pragma unroll
    for (int i = 0; i < WIDTH; ++i) {
        const float* s = inputs + 3 * i;
        x[i] = own[3 * WIDTH + i][lane] + s[0] * sample[0] + s[1] * sample[1] + s[2] * sample[2]
            + first_layer[AT_MIX_BIAS + i] + product(first_layer + AT_MIX + i * WIDTH, token);
    }
    normalised(first_layer + AT_NORM_1, x);
    feed_forward(x, token);
    normalised(first_layer + AT_NORM_2, token);

    // The second layer and the perceptron.
    const int i = lane % WIDTH;
    __syncwarp();
    if (lane < WINDOW) {
#pragma unroll
        for (int k = 0; k < WIDTH; ++k) scratch.token[lane][k] = token[k];
    }
    __syncwarp();
    const float* last = scratch.token[WINDOW - 1];
    scratch.row[i] = w[AT_SECOND_BIAS + i] + product(w + AT_SECOND + i * WIDTH, last);
    __syncwarp();
    // what the last sample's query asks of each token, per head: a query's product with the
    // keys' bias is the same for all, and the softmax cancels it
    for (int pair = lane; pair < PAIRS; pair += LANES) {
        const int h = pair / WIDTH, k = pair % WIDTH;
        float total = 0.0f;
#pragma unroll
        for (int e = 0; e < DEPTH; ++e)
            total += scratch.row[h * DEPTH + e] * w[AT_SECOND + (WIDTH + h * DEPTH + e) * WIDTH + k];
        scratch.pairs[pair] = total;
    }
    __syncwarp();
#pragma unroll
    for (int h = 0; h < HEADS; ++h) {
        const float logit = LOG2_E * product(scratch.pairs + h * WIDTH, token);
        float largest = lane < WINDOW ? logit : UNSEEN;
#pragma unroll
        for (int step = LANES / 2; step > 0; step /= 2)
            largest = fmaxf(largest, __shfl_xor_sync(ALL, largest, step));
        const float weight = lane < WINDOW ? power_of_two(logit - largest) : 0.0f;
        float total = weight;
#pragma unroll
        for (int step = LANES / 2; step > 0; step /= 2)
            total += __shfl_xor_sync(ALL, total, step);
        scratch.share[h][lane] = weight / total;
    }
    __syncwarp();
    for (int pair = lane; pair < PAIRS; pair += LANES) {
        float total = 0.0f;
        for (int j = 0; j < WINDOW; ++j)
            total += scratch.share[pair / WIDTH][j] * scratch.token[j][pair % WIDTH];
        scratch.pairs[pair] = total;
    }
    __syncwarp();
    const float* mean = scratch.pairs + i / DEPTH * WIDTH;
    scratch.row[i] = w[AT_SECOND_BIAS + 2 * WIDTH + i]
        + product(w + AT_SECOND + (2 * WIDTH + i) * WIDTH, mean);
    __syncwarp();
    const float* layer = w + AT_LAYER_2;
    float y = last[i] + layer[AT_MIX_BIAS + i] + product(layer + AT_MIX + i * WIDTH, scratch.row);
    y = normalised_row(layer + AT_NORM_1, y);
    __syncwarp();
    scratch.row[i] = y;
    __syncwarp();
    for (int f = lane; f < FEED; f += LANES) {
        const float total = product(layer + AT_FEED_1 + f * WIDTH, scratch.row);
        scratch.unit[f] = fmaxf(layer[AT_FEED_1_BIAS + f] + total, 0.0f);
    }
    __syncwarp();
    float fed = 0.0f;  // each half of the warp has half of the units
    for (int f = lane / WIDTH; f < FEED; f += LANES / WIDTH)
        fed += scratch.unit[f] * layer[AT_FEED_2 + f * WIDTH + i];
    fed += __shfl_xor_sync(ALL, fed, WIDTH);
    y = normalised_row(layer + AT_NORM_2, y + fed + layer[AT_FEED_2_BIAS + i]);
    __syncwarp();
    scratch.row[i] = y;
    __syncwarp();
    const float hidden = fmaxf(
        w[AT_HEAD_1_BIAS + lane % 8] + product(w + AT_HEAD_1 + lane % 8 * WIDTH, scratch.row), 0.0f);
    float second = w[AT_HEAD_2_BIAS + lane % 4];
#pragma unroll
    for (int k = 0; k < 8; ++k)
        second += w[AT_HEAD_2 + lane % 4 * 8 + k] * __shfl_sync(ALL, hidden, k);
    second = fmaxf(second, 0.0f);
    float answer = w[AT_HEAD_3_BIAS];
#pragma unroll
    for (int k = 0; k < 4; ++k) answer += w[AT_HEAD_3 + k] * __shfl_sync(ALL, second, k);
    if (lane == 0) force.data[servo] = fminf(answer, limit);
}
