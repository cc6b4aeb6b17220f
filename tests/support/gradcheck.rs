//! Checks of operators for tests: gradients by backpropagation against central differences in f64, equality of two
//! implementations, and identical bits for any number of threads.

use candle_core::{DType, Device, Result, Tensor, Var};

/// Pseudo-random values in -1..1, identical on every machine.
pub fn pattern(shape: &[usize], phase: f64) -> Result<Tensor> {
    let n: usize = shape.iter().product();
    let values: Vec<f64> = (0..n).map(|i| ((i as f64 + phase) * 12.9898).sin() * 43758.5453 % 1.0).collect();
    Tensor::from_vec(values, shape, &Device::Cpu)
}

/// Returns the largest difference between the gradients of `sum(f(inputs) * fixed pattern)` by backpropagation and by
/// central differences, over all values of all `inputs` (f64), relative to 1 + |gradient|.
pub fn worst(inputs: &[Tensor], f: impl Fn(&[Tensor]) -> Result<Tensor>) -> Result<f64> {
    let vars: Vec<Var> = inputs.iter().map(Var::from_tensor).collect::<Result<_>>()?;
    let tensors = |vars: &[Var]| vars.iter().map(|var| var.as_tensor().clone()).collect::<Vec<_>>();
    let objective = |inputs: &[Tensor]| {
        let y = f(inputs)?;
        (&y * pattern(y.dims(), 0.5)?)?.sum_all()
    };
    let gradients = objective(&tensors(&vars))?.backward()?;
    let mut worst = 0.0f64;
    for (which, var) in vars.iter().enumerate() {
        let Some(gradient) = gradients.get(var) else {
            candle_core::bail!("input {which} has no gradient");
        };
        let gradient = gradient.flatten_all()?.to_vec1::<f64>()?;
        let values = var.flatten_all()?.to_vec1::<f64>()?;
        for (i, backpropagated) in gradient.iter().enumerate() {
            let at = |step: f64| -> Result<f64> {
                let mut moved = values.clone();
                moved[i] += step;
                let mut inputs = inputs.to_vec();
                inputs[which] = Tensor::from_vec(moved, var.shape(), &Device::Cpu)?;
                objective(&inputs)?.to_scalar()
            };
            let step = 1e-6;
            let difference = (at(step)? - at(-step)?) / (2.0 * step);
            let error = (backpropagated - difference).abs() / (1.0 + difference.abs());
            worst = if error.is_nan() { f64::INFINITY } else { worst.max(error) };
        }
    }
    Ok(worst)
}

/// Returns the largest difference between `a` and `b` for `inputs`, over the results and the gradients of all inputs.
pub fn max_difference(
    inputs: &[Tensor],
    a: impl Fn(&[Tensor]) -> Result<Tensor>,
    b: impl Fn(&[Tensor]) -> Result<Tensor>,
) -> Result<f64> {
    let vars = inputs.iter().map(Var::from_tensor).collect::<Result<Vec<_>>>()?;
    let inputs: Vec<Tensor> = vars.iter().map(|var| var.as_tensor().clone()).collect();
    let (a, b) = (a(&inputs)?, b(&inputs)?);
    let largest_difference = |a: &Tensor, b: &Tensor| {
        let difference = (a - b)?.abs()?;
        // A maximum ignores NaN, a sum does not.
        let (largest, sum) = (difference.max_all()?.to_scalar::<f64>()?, difference.sum_all()?.to_scalar::<f64>()?);
        Ok::<_, candle_core::Error>(if sum.is_nan() { sum } else { largest })
    };
    let backward = |y: &Tensor| (y * pattern(y.dims(), 0.5)?)?.sum_all()?.backward();
    let (of_a, of_b) = (backward(&a)?, backward(&b)?);
    let mut worst = largest_difference(&a, &b)?;
    for var in &vars {
        let (Some(a), Some(b)) = (of_a.get(var), of_b.get(var)) else { candle_core::bail!("an input has no gradient") };
        let difference = largest_difference(a, b)?;
        worst = if difference > worst || difference.is_nan() { difference } else { worst };
    }
    Ok(worst)
}

/// Checks that the result of `f` on f32 inputs of these shapes and the gradient of input `which` are bitwise identical
/// for one and for three threads.
pub fn check_thread_independence(
    shapes: &[&[usize]],
    which: usize,
    f: impl Fn(&[Tensor]) -> Result<Tensor> + Sync,
) -> Result<()> {
    let f32s = |(i, shape): (usize, &&[usize])| pattern(shape, 11.0 * i as f64)?.to_dtype(DType::F32);
    let mut inputs = shapes.iter().enumerate().map(f32s).collect::<Result<Vec<_>>>()?;
    let weight = Var::from_tensor(&inputs[which])?;
    inputs[which] = weight.as_tensor().clone();
    let run = |n_threads| -> Result<[Vec<f32>; 2]> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().map_err(candle_core::Error::wrap)?;
        pool.install(|| {
            let y = f(&inputs)?;
            let gradients = y.sqr()?.sum_all()?.backward()?;
            let Some(gradient) = gradients.get(&weight) else { candle_core::bail!("input {which} has no gradient") };
            Ok([y.flatten_all()?.to_vec1()?, gradient.flatten_all()?.to_vec1()?])
        })
    };
    if run(1)? != run(3)? {
        candle_core::bail!("the results for one and for three threads differ");
    }
    Ok(())
}
