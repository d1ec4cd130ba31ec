//! Adam (Kingma & Ba 2015), one step per update, for gradient ascent.

/// Adam's moments for a flat table of parameters.
#[derive(Clone, Debug)]
pub struct Adam {
    first: Vec<f64>,
    second: Vec<f64>,
    /// β₁ᵗ and β₂ᵗ, for the correction of the moments' bias towards 0.
    decayed: (f64, f64),
}

impl Adam {
    const BETA: (f64, f64) = (0.9, 0.999);
    const EPSILON: f64 = 1e-8;

    pub fn new(parameters: usize) -> Adam {
        Adam { first: vec![0.0; parameters], second: vec![0.0; parameters], decayed: (1.0, 1.0) }
    }

    /// Moves every parameter up its gradient.
    pub fn ascend(&mut self, parameters: &mut [f64], gradient: &[f64], learning_rate: f64) {
        let (b1, b2) = Self::BETA;
        self.decayed = (self.decayed.0 * b1, self.decayed.1 * b2);
        // The corrections once for all parameters: m/c₁ / (√(v/c₂) + ε) = m/c₁ / (√v/√c₂ + ε).
        let step = learning_rate / (1.0 - self.decayed.0);
        let scale = 1.0 / (1.0 - self.decayed.1).sqrt();
        for ((parameter, g), (m, v)) in
            parameters.iter_mut().zip(gradient).zip(self.first.iter_mut().zip(&mut self.second))
        {
            *m = b1 * *m + (1.0 - b1) * g;
            *v = b2 * *v + (1.0 - b2) * (g * g);
            *parameter += step * *m / (v.sqrt() * scale + Self::EPSILON);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first step has the learning rate's size, whatever the gradient's; then it climbs a hill.
    #[test]
    fn it_takes_its_step_and_finds_the_top() {
        let mut parameters = [0.0, 0.0];
        let mut adam = Adam::new(2);
        adam.ascend(&mut parameters, &[1e-3, -20.0], 0.1);
        assert!((parameters[0] - 0.1).abs() < 1e-5 && (parameters[1] + 0.1).abs() < 1e-5);
        for _ in 0..2000 {
            let gradient = [3.0 - parameters[0], -1.0 - parameters[1]];
            adam.ascend(&mut parameters, &gradient, 0.05);
        }
        assert!((parameters[0] - 3.0).abs() < 1e-3 && (parameters[1] + 1.0).abs() < 1e-3);
    }
}
