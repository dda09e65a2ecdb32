"""The kinds of value that a spec holds, a module each family; what each refuses is said by `refusal`."""
