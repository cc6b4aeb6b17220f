// Kernels of the networks and of their training, on contiguous tensors with channels first. Every kernel has one argument
// block, whose fields `launch.rs` fills in the order of the first lines of the kernel. Each sum is computed by one block in
// a fixed order, without atomic operations, so that results are reproducible. No kernel depends on the number of threads
// of a block, a power of two up to MAX_THREADS: the tests also compile them for the CPU, with one thread.

#ifndef REAL
#define REAL float
#endif
typedef REAL real;

struct Arguments {
    unsigned long long tensors[12]; // addresses; 0: absent
    int ints[12];
    double numbers[8];
};

#define MAX_THREADS 256
#define KERNEL(name) extern "C" __global__ void name(Arguments a)
#define TENSOR(i) ((real*)a.tensors[i])
// Indices of all results, distributed over all threads of all blocks.
#define EACH(i, n) (int i = blockIdx.x * blockDim.x + threadIdx.x; i < (n); i += gridDim.x * blockDim.x)
// Indices distributed over the threads of this block.
#define EACH_OF_BLOCK(i, n) (int i = threadIdx.x; i < (n); i += blockDim.x)

// Sum over the threads of a block, the same in every thread.
__device__ double block_sum(double value) {
    __shared__ double sums[MAX_THREADS];
    __syncthreads();
    sums[threadIdx.x] = value;
    __syncthreads();
    for (int half = blockDim.x / 2; half > 0; half /= 2) {
        if (threadIdx.x < half) sums[threadIdx.x] += sums[threadIdx.x + half];
        __syncthreads();
    }
    return sums[0];
}

// Statistics of a normalisation: none (bias and activation only), those of the batch, or the running ones.
enum { NONE = 0, BATCH = 1, RUNNING = 2 };

// Position of value `i` of channel `c` in the samples from `first` on, each [channels, len].
__device__ int position(int i, int first, int channels, int c, int len) {
    return ((first + i / len) * channels + c) * len + i % len;
}

// Bias, batch norm and leaky ReLU of `z` [samples, channels, len], one block per channel. The samples consist of groups of
// equal size with their own statistics, in the order of which the running ones are updated.
KERNEL(normalise_forward) {
    const real *z = TENSOR(0), *bias = TENSOR(1), *weight = TENSOR(2), *shift_weight = TENSOR(3);
    real *running_mean = TENSOR(4), *running_variance = TENSOR(5), *y = TENSOR(6), *statistics = TENSOR(7);
    const int samples = a.ints[0], channels = a.ints[1], len = a.ints[2], groups = a.ints[3], mode = a.ints[4];
    const double eps = a.numbers[0], momentum = a.numbers[1];
    const real slope = a.numbers[2];
    const int c = blockIdx.x, per_group = samples / groups, n = per_group * len;
    for (int group = 0; group < groups; group++) {
        const int first = group * per_group;
        double mean = 0, variance = 1;
        if (mode == BATCH) {
            double sum = 0, squares = 0;
            for EACH_OF_BLOCK(i, n) sum += z[position(i, first, channels, c, len)];
            mean = block_sum(sum) / n;
            for EACH_OF_BLOCK(i, n) {
                const double off = z[position(i, first, channels, c, len)] - mean;
                squares += off * off;
            }
            variance = block_sum(squares) / n;
            if (threadIdx.x == 0) {
                // `z` lacks the bias, which only shifts the mean; the running variance is the unbiased one.
                const double unbiased = variance * n / (n > 1 ? n - 1 : 1);
                running_mean[c] = (1 - momentum) * running_mean[c] + momentum * (mean + bias[c]);
                running_variance[c] = (1 - momentum) * running_variance[c] + momentum * unbiased;
            }
        } else if (mode == RUNNING) {
            mean = (double)running_mean[c] - bias[c];
            variance = running_variance[c];
        }
        const double inverse = mode == NONE ? 1 : 1 / sqrt(variance + eps);
        if (threadIdx.x == 0) {
            statistics[2 * (group * channels + c)] = mean;
            statistics[2 * (group * channels + c) + 1] = inverse;
        }
        const real scale = mode == NONE ? 1 : weight[c] * inverse;
        const real shift = mode == NONE ? bias[c] : shift_weight[c] - mean * weight[c] * inverse;
        for EACH_OF_BLOCK(i, n) {
            const int at = position(i, first, channels, c, len);
            const real value = z[at] * scale + shift;
            y[at] = value > 0 ? value : value * slope;
        }
    }
}

// Gradient of `z` from that of the result. Gradients of the parameters are added to those that are given.
KERNEL(normalise_backward) {
    const real *z = TENSOR(0), *bias = TENSOR(1), *weight = TENSOR(2), *shift_weight = TENSOR(3);
    const real *statistics = TENSOR(4), *grad = TENSOR(5);
    real *grad_z = TENSOR(6), *grad_bias = TENSOR(7), *grad_weight = TENSOR(8), *grad_shift = TENSOR(9);
    const int samples = a.ints[0], channels = a.ints[1], len = a.ints[2], groups = a.ints[3], mode = a.ints[4];
    const real slope = a.numbers[0];
    const int c = blockIdx.x, per_group = samples / groups, n = per_group * len;
    for (int group = 0; group < groups; group++) {
        const int first = group * per_group;
        const double mean = statistics[2 * (group * channels + c)];
        const double inverse = statistics[2 * (group * channels + c) + 1];
        const real scale = mode == NONE ? 1 : weight[c] * inverse;
        const real shift = mode == NONE ? bias[c] : shift_weight[c] - mean * weight[c] * inverse;
        double plain = 0, product = 0;
        for EACH_OF_BLOCK(i, n) {
            const int at = position(i, first, channels, c, len);
            const real g = z[at] * scale + shift > 0 ? grad[at] : grad[at] * slope;
            plain += g;
            product += g * (z[at] - mean);
        }
        plain = block_sum(plain);
        product = block_sum(product);
        if (threadIdx.x == 0) {
            // Subtracting the batch's own mean cancels the bias.
            if (grad_bias && mode != BATCH) grad_bias[c] += scale * plain;
            if (grad_weight && mode != NONE) grad_weight[c] += product * inverse;
            if (grad_shift && mode != NONE) grad_shift[c] += plain;
        }
        // Only the batch's own statistics depend on `z`.
        const real constant = mode == BATCH ? -scale * plain / n : 0;
        const real linear = mode == BATCH ? -scale * product * inverse * inverse / n : 0;
        for EACH_OF_BLOCK(i, n) {
            const int at = position(i, first, channels, c, len);
            const real g = z[at] * scale + shift > 0 ? grad[at] : grad[at] * slope;
            grad_z[at] = scale * g + constant + linear * (z[at] - (real)mean);
        }
    }
}

// Rows and columns cut, or extended by zeros, at their end: [n, rows, columns] to [n, new rows, new columns], after `cut`
// columns were removed and `added` ones inserted at the start.
KERNEL(resize) {
    const real* x = TENSOR(0);
    real* y = TENSOR(1);
    const int n = a.ints[0], rows = a.ints[1], columns = a.ints[2], new_rows = a.ints[3], new_columns = a.ints[4];
    const int cut = a.ints[5], added = a.ints[6];
    for EACH(i, n * new_rows * new_columns) {
        const int column = i % new_columns + cut - added, row = i / new_columns % new_rows, matrix = i / new_columns / new_rows;
        y[i] = row < rows && column >= 0 && column < columns ? x[(matrix * rows + row) * columns + column] : 0;
    }
}

// Input frames and the weight of the second, for frame `t` of a linear interpolation from `n_in` frames, `num / den` per
// frame of the result.
__device__ double source_frame(int t, int n_in, int num, int den, int* before) {
    const double at = (double)t * num / den;
    *before = (int)at < n_in - 1 ? (int)at : n_in - 1;
    return at - *before;
}

// Linear interpolation of frames, [rows, T] to [rows, T'], from frame `first` of the result on; `x` begins with input frame
// `needed`.
KERNEL(interpolate_forward) {
    const real* x = TENSOR(0);
    real* y = TENSOR(1);
    const int rows = a.ints[0], len = a.ints[1], new_len = a.ints[2], n_in = a.ints[3], num = a.ints[4];
    const int den = a.ints[5], first = a.ints[6], needed = a.ints[7];
    for EACH(i, rows * new_len) {
        int before;
        const real share = source_frame(first + i % new_len, n_in, num, den, &before);
        const int at = before - needed, next = at + 1 < len ? at + 1 : len - 1;
        const real* row = x + i / new_len * len;
        y[i] = row[at] + (row[next] - row[at]) * share;
    }
}

// Gradient of the input of a complete interpolation.
KERNEL(interpolate_backward) {
    const real* grad = TENSOR(0);
    real* grad_x = TENSOR(1);
    const int rows = a.ints[0], n_in = a.ints[1], n_out = a.ints[2], num = a.ints[3], den = a.ints[4];
    for EACH(i, rows * n_in) {
        const int frame = i % n_in;
        const real* row = grad + i / n_in * n_out;
        int first = (int)((double)(frame - 1) * den / num) - 1;
        int last = frame == n_in - 1 ? n_out : (int)((double)(frame + 1) * den / num) + 2;
        first = first > 0 ? first : 0;
        last = last < n_out ? last : n_out;
        double sum = 0;
        for (int t = first; t < last; t++) {
            int before;
            const double share = source_frame(t, n_in, num, den, &before);
            const int next = before + 1 < n_in ? before + 1 : n_in - 1;
            if (before == frame) sum += (1 - share) * row[t];
            if (next == frame) sum += share * row[t];
        }
        grad_x[i] = sum;
    }
}

// Every frame of `x` [rows, T] twice, `delay` frames later (0 or 1), plus `skip` [rows, 2T].
KERNEL(repeat_and_add) {
    const real *x = TENSOR(0), *skip = TENSOR(1);
    real* y = TENSOR(2);
    const int n = a.ints[0], len = a.ints[1], delay = a.ints[2];
    for EACH(i, n) y[i] = i % len < delay ? skip[i] : x[(i - delay) / 2] + skip[i];
}

KERNEL(repeat_backward) {
    const real* grad = TENSOR(0);
    real* grad_x = TENSOR(1);
    const int n = a.ints[0], len = a.ints[1], delay = a.ints[2];
    for EACH(i, n) {
        const int first = 2 * i + delay;
        grad_x[i] = grad[first] + ((first + 1) % len == 0 ? 0 : grad[first + 1]);
    }
}

// sum += x
KERNEL(accumulate) {
    real* sum = TENSOR(0);
    const real* x = TENSOR(1);
    for EACH(i, a.ints[0]) sum[i] += x[i];
}
