//! Symmetric sparse matrices.

/// A symmetric matrix by rows: both triangles are stored, columns ascend within a row, and every
/// row has its diagonal.
#[derive(Clone, Debug, PartialEq)]
pub struct Symmetric {
    /// Where each row starts in the other two; one more than there are rows.
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

/// Collects the entries of a [`Symmetric`].
#[derive(Debug)]
pub struct Builder {
    entries: Vec<(u32, u32, f64)>,
}

impl Builder {
    /// With zeros on the diagonal of `size` rows.
    pub fn new(size: usize) -> Builder {
        Builder {
            entries: (0..size as u32).map(|i| (i, i, 0.0)).collect(),
        }
    }

    /// Adds a symmetric block over variables that differ from each other.
    pub fn add_block<const N: usize>(&mut self, variables: [u32; N], block: [[f64; N]; N]) {
        for (row, values) in variables.into_iter().zip(block) {
            for (column, value) in variables.into_iter().zip(values) {
                self.entries.push((row, column, value));
            }
        }
    }

    /// Adds the product of a form with itself: `weight` times the square of the sum of
    /// `coefficients` times the variables, which differ from each other.
    pub fn add_square<const N: usize>(
        &mut self,
        variables: [u32; N],
        coefficients: [f64; N],
        weight: f64,
    ) {
        self.add_block(
            variables,
            coefficients.map(|a| coefficients.map(|b| weight * a * b)),
        );
    }

    /// The matrix. Entries at the same place are added in the order in which they came.
    pub fn build(self, size: usize) -> Symmetric {
        let mut starts = vec![0; size + 1];
        for entry in &self.entries {
            starts[entry.0 as usize + 1] += 1;
        }
        for i in 0..size {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut scattered = vec![(0, 0.0); self.entries.len()];
        for (row, column, value) in self.entries {
            let at = &mut next[row as usize];
            scattered[*at] = (column, value);
            *at += 1;
        }
        let mut matrix = Symmetric {
            starts: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
        };
        for row in 0..size {
            let entries = &mut scattered[starts[row]..starts[row + 1]];
            entries.sort_by_key(|entry| entry.0);
            for same in entries.chunk_by(|a, b| a.0 == b.0) {
                matrix.columns.push(same[0].0);
                matrix.values.push(same.iter().map(|entry| entry.1).sum());
            }
            matrix.starts.push(matrix.columns.len());
        }
        matrix
    }
}

impl Symmetric {
    /// Number of rows.
    pub fn size(&self) -> usize {
        self.starts.len() - 1
    }

    /// Columns of a row, ascending.
    pub fn columns(&self, row: usize) -> &[u32] {
        &self.columns[self.starts[row]..self.starts[row + 1]]
    }

    /// Columns and values of a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[row]..self.starts[row + 1];
        let columns = self.columns[range.clone()].iter();
        columns
            .zip(&self.values[range])
            .map(|(column, value)| (*column as usize, *value))
    }

    pub fn diagonal(&self, row: usize) -> f64 {
        match self.columns(row).binary_search(&(row as u32)) {
            Ok(at) => self.values[self.starts[row] + at],
            Err(_) => 0.0,
        }
    }

    /// Row `row` times a vector.
    pub fn row_times(&self, row: usize, x: &[f64]) -> f64 {
        self.row(row).map(|(column, value)| value * x[column]).sum()
    }

    /// The rows and columns in `list`, in its order. `place` tells for each of them where it stands
    /// in the list; no row in the list has a column outside.
    pub fn restrict(&self, list: &[u32], place: &[u32]) -> Symmetric {
        let mut part = Symmetric {
            starts: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
        };
        let mut row = Vec::new();
        for &i in list {
            row.clear();
            row.extend(self.row(i as usize).map(|(j, value)| (place[j], value)));
            row.sort_unstable_by_key(|entry| entry.0);
            part.columns.extend(row.iter().map(|entry| entry.0));
            part.values.extend(row.iter().map(|entry| entry.1));
            part.starts.push(part.columns.len());
        }
        part
    }

    /// The connected components, each in ascending order, by their least members.
    pub fn components(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.size()];
        let mut all = Vec::new();
        for first in 0..self.size() {
            if seen[first] {
                continue;
            }
            seen[first] = true;
            let mut component = vec![first as u32];
            let mut next = 0;
            while let Some(&i) = component.get(next) {
                next += 1;
                for &j in self.columns(i as usize) {
                    if !seen[j as usize] {
                        seen[j as usize] = true;
                        component.push(j);
                    }
                }
            }
            component.sort_unstable();
            all.push(component);
        }
        all
    }
}
