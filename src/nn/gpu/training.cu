// Kernels of a training step of the GAN: forward kinematics, losses, Adam and the average of the weights. Compiled with
// `kernels.cu`, whose conventions apply.

#include "kernels.cu"

// Frame-to-frame differences [rows, T - 1] of `real` (if given) and then of `generated`, both [rows, T], 0 where the mask of
// either frame is 0, plus noise (if given) of the shape of the result.
KERNEL(motion_forward) {
    const real *truth = TENSOR(0), *generated = TENSOR(1), *mask = TENSOR(2), *noise = TENSOR(3);
    real* y = TENSOR(4);
    const int rows = a.ints[0], len = a.ints[1], n = rows * (len - 1);
    for EACH(i, truth ? 2 * n : n) {
        const real* poses = truth && i < n ? truth : generated;
        const int at = i % n / (len - 1) * len + i % (len - 1);
        y[i] = (poses[at + 1] - poses[at]) * (mask[at + 1] * mask[at]) + (noise ? noise[i] : 0);
    }
}

// Gradient of `generated`, if there was no `real`.
KERNEL(motion_backward) {
    const real *grad = TENSOR(0), *mask = TENSOR(1);
    real* grad_poses = TENSOR(2);
    const int rows = a.ints[0], len = a.ints[1];
    for EACH(i, rows * len) {
        const int t = i % len;
        const real* row = grad + i / len * (len - 1);
        const real before = t > 0 ? row[t - 1] * mask[i] * mask[i - 1] : 0;
        const real after = t < len - 1 ? row[t] * mask[i + 1] * mask[i] : 0;
        grad_poses[i] = before - after;
    }
}

// Tables of the forward kinematics, each with three values per bone: mean and deviation of the directions, mean and
// deviation of the positions, and a third table of length and parent (-1: the neck) of every bone.
struct Bones {
    const real *direction_mean, *direction_std, *mean, *std, *lengths, *parents;
    int n;
};

__device__ Bones bones(const real* tables, int n) {
    const int m = 3 * n;
    return {tables, tables + m, tables + 2 * m, tables + 3 * m, tables + 4 * m, tables + 4 * m + n, n};
}

// Direction of bone `bone` in frame `t` of `raw` [3 bones, len], and its length.
__device__ real direction(const Bones& of, const real* raw, int bone, int t, int len, real* d) {
    real squares = 0;
    for (int k = 0; k < 3; k++) {
        d[k] = raw[(3 * bone + k) * len + t] * of.direction_std[3 * bone + k] + of.direction_mean[3 * bone + k];
        squares += d[k] * d[k];
    }
    return sqrt(squares + (real)1e-12);
}

// Raw features [samples, features, len] to normalised positions; features after those of the bones are copied.
KERNEL(kinematics_forward) {
    const real* raw = TENSOR(0);
    real* poses = TENSOR(2);
    const int samples = a.ints[0], features = a.ints[1], len = a.ints[2];
    const Bones of = bones(TENSOR(1), a.ints[3]);
    for EACH(i, samples * (features / 3) * len) {
        const int t = i % len, triple = i / len % (features / 3), sample = i / len / (features / 3) * features * len;
        const real* x = raw + sample;
        real position[3] = {0, 0, 0};
        for (int bone = triple < of.n ? triple : -1; bone >= 0; bone = (int)of.parents[bone]) {
            real d[3];
            const real norm = direction(of, x, bone, t, len, d);
            for (int k = 0; k < 3; k++) position[k] += d[k] / norm * of.lengths[bone];
        }
        for (int k = 0; k < 3; k++) {
            const int feature = 3 * triple + k, at = feature * len + t;
            poses[sample + at] = triple < of.n ? (position[k] - of.mean[feature]) / of.std[feature] : x[at];
        }
    }
}

KERNEL(kinematics_backward) {
    const real *raw = TENSOR(0), *grad = TENSOR(2);
    real* grad_raw = TENSOR(3);
    const int samples = a.ints[0], features = a.ints[1], len = a.ints[2];
    const Bones of = bones(TENSOR(1), a.ints[3]);
    for EACH(i, samples * (features / 3) * len) {
        const int t = i % len, triple = i / len % (features / 3), sample = i / len / (features / 3) * features * len;
        real g[3] = {0, 0, 0}, d[3];
        if (triple >= of.n) {
            for (int k = 0; k < 3; k++) {
                grad_raw[sample + (3 * triple + k) * len + t] = grad[sample + (3 * triple + k) * len + t];
            }
            continue;
        }
        // Every joint whose path from the neck contains this bone.
        for (int joint = 0; joint < of.n; joint++) {
            int bone = joint;
            while (bone >= 0 && bone != triple) bone = (int)of.parents[bone];
            for (int k = 0; k < 3 && bone >= 0; k++) {
                g[k] += grad[sample + (3 * joint + k) * len + t] / of.std[3 * joint + k];
            }
        }
        const real norm = direction(of, raw + sample, triple, t, len, d);
        const real along = (g[0] * d[0] + g[1] * d[1] + g[2] * d[2]) / (norm * norm);
        for (int k = 0; k < 3; k++) {
            const int feature = 3 * triple + k;
            grad_raw[sample + feature * len + t] =
                of.lengths[triple] / norm * (g[k] - d[k] * along) * of.direction_std[feature];
        }
    }
}

// Squared speed of a joint between frame `t` and the next; `visible` is 1 where all its coordinates are, in both frames.
__device__ real squared_speed(const real* poses, int len, int t) {
    real squares = 0;
    for (int k = 0; k < 3; k++) {
        const real step = poses[k * len + t + 1] - poses[k * len + t];
        squares += step * step;
    }
    return squares;
}

__device__ real visible(const real* mask, int len, int t) {
    real least = 1;
    for (int k = 0; k < 3; k++) {
        const real both = mask[k * len + t + 1] * mask[k * len + t];
        least = both < least ? both : least;
    }
    return least;
}

// Sums of the losses of poses [samples, features, len], one block per sample and three features: absolute errors and their
// number; squared errors and squares of the speeds; both energies and the number of visible steps. [samples, features / 3, 7]
#define N_SUMS 7
KERNEL(pose_sums) {
    const int features = a.ints[0], len = a.ints[1], n_joints = a.ints[2];
    const int first = 3 * blockIdx.x * len;
    const real *poses = TENSOR(0) + first, *truth = TENSOR(1) + first, *mask = TENSOR(2) + first;
    real* sums = TENSOR(3) + N_SUMS * blockIdx.x;
    double of_thread[N_SUMS] = {0, 0, 0, 0, 0, 0, 0};
    for EACH_OF_BLOCK(i, 3 * len) {
        of_thread[0] += fabs(poses[i] - truth[i]) * mask[i];
        of_thread[1] += mask[i];
    }
    if (blockIdx.x % (features / 3) < n_joints) {
        for EACH_OF_BLOCK(t, len - 1) {
            const real is_visible = visible(mask, len, t);
            const real own = squared_speed(poses, len, t), real_one = squared_speed(truth, len, t);
            const real speed = sqrt(own + (real)1e-6), real_speed = sqrt(real_one + (real)1e-6);
            of_thread[2] += (speed - real_speed) * (speed - real_speed) * is_visible;
            of_thread[3] += real_speed * real_speed * is_visible;
            of_thread[4] += own * is_visible;
            of_thread[5] += real_one * is_visible;
            of_thread[6] += is_visible;
        }
    }
    for (int k = 0; k < N_SUMS; k++) {
        const double sum = block_sum(of_thread[k]);
        if (threadIdx.x == 0) sums[k] = sum;
    }
}

// Losses from these sums, in one block: L1, speed, energy, their weighted sum, and the factors that `pose_backward` needs:
// of L1, of speed, and of the energy of every joint.
KERNEL(pose_losses) {
    const real* sums = TENSOR(0);
    real *losses = TENSOR(1), *total = TENSOR(2), *factors = TENSOR(3);
    const int samples = a.ints[0], triples = a.ints[1], n_joints = a.ints[2];
    const double weight_l1 = a.numbers[0], weight_speed = a.numbers[1], weight_energy = a.numbers[2];
    double all[4] = {0, 0, 0, 0}, difference = 0;
    for EACH_OF_BLOCK(i, samples * triples) {
        for (int k = 0; k < 4; k++) all[k] += sums[N_SUMS * i + k];
    }
    for (int k = 0; k < 4; k++) all[k] = block_sum(all[k]);
    for EACH_OF_BLOCK(joint, n_joints) {
        double own = 0, truth = 0, n = 0;
        for (int sample = 0; sample < samples; sample++) {
            const real* of = sums + N_SUMS * (sample * triples + joint);
            own += of[4];
            truth += of[5];
            n += of[6];
        }
        n = n > 1 ? n : 1;
        own = own / n + 1e-6;
        truth = truth / n + 1e-6;
        const double ratio = log(own) - log(truth);
        difference += fabs(ratio) / n_joints;
        factors[2 + joint] = weight_energy * (ratio >= 0 ? 2 : -2) / (n_joints * own * n);
    }
    const double energy = block_sum(difference);
    if (threadIdx.x == 0) {
        const double n = all[1] > 1 ? all[1] : 1, scale = all[3] > 1e-6 ? all[3] : 1e-6;
        losses[0] = all[0] / n;
        losses[1] = all[2] / scale;
        losses[2] = energy;
        factors[0] = weight_l1 / n;
        factors[1] = weight_speed * 2 / scale;
        total[0] = weight_l1 * losses[0] + weight_speed * losses[1] + weight_energy * energy;
    }
}

// Gradient of the weighted sum of the losses, multiplied by that of the sum.
KERNEL(pose_backward) {
    const real *poses = TENSOR(0), *truth = TENSOR(1), *mask = TENSOR(2), *factors = TENSOR(3), *grad = TENSOR(4);
    real* grad_poses = TENSOR(5);
    const int samples = a.ints[0], features = a.ints[1], len = a.ints[2], n_joints = a.ints[3];
    for EACH(i, samples * (features / 3) * len) {
        const int t = i % len, triple = i / len % (features / 3), first = i / len * 3 * len;
        const real *x = poses + first, *y = truth + first, *m = mask + first;
        real g[3];
        for (int k = 0; k < 3; k++) {
            const int at = k * len + t;
            g[k] = factors[0] * m[at] * (x[at] >= y[at] ? 1 : -1);
        }
        // The steps to and from this frame.
        for (int step = t > 0 ? t - 1 : 0; triple < n_joints && step <= t && step < len - 1; step++) {
            const real own = sqrt(squared_speed(x, len, step) + (real)1e-6);
            const real other = sqrt(squared_speed(y, len, step) + (real)1e-6);
            const real factor = (factors[1] * (own - other) / own + factors[2 + triple]) * visible(m, len, step);
            for (int k = 0; k < 3; k++) {
                const real change = factor * (x[k * len + step + 1] - x[k * len + step]);
                g[k] += step < t ? change : -change;
            }
        }
        for (int k = 0; k < 3; k++) grad_poses[first + k * len + t] = g[k] * grad[0];
    }
}

// Adversarial terms of a score.
enum { DISTANCE_TO_1 = 0, DISTANCE_TO_0 = 1, REJECTED = 2, ACCEPTED = 3, MINUS_ACCEPTED = 4 };

// Sum of the means of one term over the first `n_first` scores and of another over the rest, in one block: the loss, the
// loss times its weight, and the gradient of the latter.
KERNEL(score_losses) {
    const real* scores = TENSOR(0);
    real *loss = TENSOR(1), *weighted = TENSOR(2), *grad = TENSOR(3);
    const int n = a.ints[0], n_first = a.ints[1];
    const double weight = a.numbers[0];
    double sum = 0;
    for EACH_OF_BLOCK(i, n) {
        const int term = i < n_first ? a.ints[2] : a.ints[3], count = i < n_first ? n_first : n - n_first;
        double value, slope;
        if (term <= DISTANCE_TO_0) {
            const double off = scores[i] - (term == DISTANCE_TO_1 ? 1 : 0);
            value = off * off;
            slope = 2 * off;
        } else {
            // log(1 + e^x) without overflow, of the score or of its negative.
            const double x = term == REJECTED ? -scores[i] : scores[i], sign = term == ACCEPTED ? 1 : -1;
            value = ((x > 0 ? x : 0) + log(1 + exp(-fabs(x)))) * (term == MINUS_ACCEPTED ? -1 : 1);
            slope = sign / (1 + exp(-x));
        }
        sum += value / count;
        grad[i] = weight * slope / count;
    }
    sum = block_sum(sum);
    if (threadIdx.x == 0) {
        loss[0] = sum;
        weighted[0] = weight * sum;
    }
}

// Sum of squares of part `blockIdx.x` of `x`.
KERNEL(square_sums) {
    const real* x = TENSOR(0);
    real* sums = TENSOR(1);
    double sum = 0;
    for EACH(i, a.ints[0]) sum += (double)x[i] * x[i];
    sum = block_sum(sum);
    if (threadIdx.x == 0) sums[blockIdx.x] = sum;
}

// One update by Adam of a part of a tensor per block; row `blockIdx.x` of the parts has its address, its first position in
// the flat gradients and moments, its length, and the index of the tensor. Gradients are set to 0 for the next step. Nothing
// is updated if the norm of all gradients is not finite.
KERNEL(adam) {
    const long long* part = (const long long*)a.tensors[0] + 4 * blockIdx.x;
    const real *factors = TENSOR(1) + 2 * part[3], *square_sums = TENSOR(2);
    real* value = (real*)part[0];
    real *grad = TENSOR(3) + part[1], *first = TENSOR(4) + part[1], *second = TENSOR(5) + part[1];
    real *largest = a.tensors[6] ? TENSOR(6) + part[1] : 0, *norm = TENSOR(7);
    const int n_sums = a.ints[0];
    const double beta1 = a.numbers[0], beta2 = a.numbers[1], eps = a.numbers[2], learning_rate = a.numbers[3];
    const double correction1 = a.numbers[4], correction2 = a.numbers[5], max_norm = a.numbers[6];
    double squares = 0;
    for (int i = 0; i < n_sums; i++) squares += square_sums[i];
    const double all = sqrt(squares);
    if (blockIdx.x == 0 && threadIdx.x == 0) norm[0] = all;
    const bool is_updated = all - all == 0 && factors[0] > 0;
    const real scale = all > max_norm ? max_norm / all : 1;
    const real rate = learning_rate * factors[0] / correction1, keep = 1 - learning_rate * factors[0] * factors[1];
    const real spread_scale = sqrt(1 / correction2);
    for EACH_OF_BLOCK(i, part[2]) {
        const real g = grad[i] * scale;
        grad[i] = 0;
        if (!is_updated) continue;
        first[i] = (real)beta1 * first[i] + (1 - (real)beta1) * g;
        second[i] = (real)beta2 * second[i] + (1 - (real)beta2) * g * g;
        real spread = second[i];
        if (largest) spread = largest[i] = largest[i] > spread ? largest[i] : spread;
        value[i] = keep * value[i] - rate * first[i] / (sqrt(spread) * spread_scale + (real)eps);
    }
}

// mean = decay x mean + (1 - decay) x now for a part of a tensor per block; rows of the parts: both addresses and length.
KERNEL(average) {
    const long long* part = (const long long*)a.tensors[0] + 3 * blockIdx.x;
    real* mean = (real*)part[0];
    const real *now = (const real*)part[1], decay = a.numbers[0];
    for EACH_OF_BLOCK(i, part[2]) mean[i] = decay * mean[i] + (1 - decay) * now[i];
}
